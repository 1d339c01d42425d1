"""``python -m fabfem`` is the ``fabfem`` command."""

from fabfem.cli import main

raise SystemExit(main())
