"""Problems with known answers, one file each, run as a user's cases are: tables of a case, mesh file, build, march."""
