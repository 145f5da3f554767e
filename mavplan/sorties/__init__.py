"""One plan flown on several batteries: sorties, each a mission of its own that comes home with its reserve."""
