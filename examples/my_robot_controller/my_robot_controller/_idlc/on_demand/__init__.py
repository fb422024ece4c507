"""Features of messages that most programs never use: imported on first use."""
