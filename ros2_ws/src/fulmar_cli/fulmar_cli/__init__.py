"""The command `fulmar`: each command parses, calls one function, prints."""

from fulmar_core.config.module_path import search_strangers_last

search_strangers_last()  # before anything else is imported
