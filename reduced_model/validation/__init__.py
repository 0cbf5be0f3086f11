"""Where assumed modes hold and where not, in numbers: the sections of docs/validation.md, each computed anew."""
