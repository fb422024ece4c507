"""Model: what interface files mean."""
