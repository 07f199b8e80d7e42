"""Scenes on which multibody systems fail, often silently: definitions, references, and what must hold."""
