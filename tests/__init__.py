"""Tests of idlc, in folders by room; `support` has what several of them need."""
