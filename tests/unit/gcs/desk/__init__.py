"""The operator's desk: intents, rules, orders."""
