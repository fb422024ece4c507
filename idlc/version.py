"""The version of idlc, which a release raises."""

__version__ = "0.2.0"
#: What a package requires that does not carry its runtime.
RUNTIME = f"idlc-runtime>={__version__}"
