"""Doubly asymptotic (heteroclinic) orbits with short codes, and what theta3 gains along them."""
