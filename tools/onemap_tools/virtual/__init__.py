"""The services in virtual time: a scheduler, a network and processes, all functions of a seed."""
