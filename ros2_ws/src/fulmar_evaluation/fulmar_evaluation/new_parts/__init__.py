"""Classes of a user's own: the files of the pages docs/own-*.md under another name, with a test beside each."""
