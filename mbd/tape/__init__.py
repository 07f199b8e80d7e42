"""The scalar expression graph on which all mechanics is traced, folded and differentiated."""
