"""Certified route codes: a rigorous a-posteriori proof of every symbol."""

from rigidpend.certified.codes import CertifiedCodes, certify_codes

__all__ = ["CertifiedCodes", "certify_codes"]
