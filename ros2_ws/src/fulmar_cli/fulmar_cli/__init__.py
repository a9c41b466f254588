"""The command `fulmar`: each command parses, calls one function, prints."""
