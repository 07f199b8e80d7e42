"""Laws, references and cases of the project: a package, as libraries exist that install one of the same name."""
