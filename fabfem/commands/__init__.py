"""What the words after ``fabfem`` do: each module adds its commands to the parser and carries them out.

A command returns its exit status and imports what is heavy only when it is called. One that several processes may
share says so by the default ``shared=True``.
"""
