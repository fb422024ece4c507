"""What messages can do and most programs never ask for: imported when it is asked for."""
