"""Tests of idlc, in folders by stage; `support` has what several of them need."""
