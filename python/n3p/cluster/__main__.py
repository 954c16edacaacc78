"""``python -m n3p.cluster``."""

import sys

from n3p.cluster.cli import main

sys.exit(main())
