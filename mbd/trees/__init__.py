"""Typed trees of functions, and what prints them: for LLVM, and as C."""
