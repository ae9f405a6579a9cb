"""What is done with scenarios: run, watch, reproduce, check, replay."""
