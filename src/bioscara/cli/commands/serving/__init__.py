"""Commands about an arm of many programs: its owner, gateways, recordings, looking, STOP."""
