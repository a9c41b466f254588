"""Our policies and classical controllers beside the tables of the El-Hariry thesis: judged, printed, drawn."""
