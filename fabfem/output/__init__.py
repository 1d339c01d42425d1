"""What a run leaves behind: ``history.csv``, ``fields.pvd`` with its ``.vtu`` files, and ``report.json``.

Every file is readable at any moment: the history grows by whole lines, the others are written aside and renamed, so
that a killed run leaves a result up to its last converged increment. Stress and strain are positive in compression.
"""
