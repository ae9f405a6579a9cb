"""How Python becomes machine code: jit, its cache on the disk, and the records it reads."""
