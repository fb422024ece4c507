"""Where idlc's claims of speed are measured, against every peer in one run; never asserted."""
