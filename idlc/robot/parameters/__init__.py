"""The parameters of nodes: values, declarations, services, and values from the command line."""
