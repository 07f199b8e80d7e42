"""The tangent pass: the kernel's own typed trees, printed a second time with derivatives beside every real."""
