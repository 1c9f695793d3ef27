"""``python -m braidcast`` is the ``braidcast`` command."""

from braidcast.cli import main

main()
