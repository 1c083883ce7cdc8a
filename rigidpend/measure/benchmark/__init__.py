"""How fast and how exact rigidpend is beside others: problems, methods, and the protocol.

tasks      what a method is asked for, and what it answers with
problems   the five problems, each with its error and its reference in 113 bits
methods    ours and the others, each as its users would write it
flat       a field as the plain Python that a hand would write
protocol   how time and memory are measured
worker     one method on one problem, in a process of its own
records    the data of a measurement
tables     what the data says, as rows of text
"""
