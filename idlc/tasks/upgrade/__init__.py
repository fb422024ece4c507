"""`idlc upgrade`: recordings of earlier versions."""
