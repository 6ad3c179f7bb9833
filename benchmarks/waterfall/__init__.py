"""Where a message's time goes, stage by stage, from its producer to its consumer."""
