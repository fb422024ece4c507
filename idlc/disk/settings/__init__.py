"""What a project has set: [tool.idlc], the settings of commands, templates of its own."""
