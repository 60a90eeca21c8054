"""PX4's control cascade, compiled: guidance -> position -> velocity -> attitude -> rates -> rotors."""
