"""Entry point of the process that learns: `python -m training.dreamer REQUEST DESCRIPTOR`."""

from training.dreamer.learn import main

raise SystemExit(main())
