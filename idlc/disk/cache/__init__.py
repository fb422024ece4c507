"""What idlc can always make again, kept for the next run."""
