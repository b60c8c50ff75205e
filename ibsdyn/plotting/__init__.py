"""How each result looks; matplotlib is imported only when something is drawn."""
