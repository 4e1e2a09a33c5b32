// Source file of the target that holds the precompiled headers of the standard library.
