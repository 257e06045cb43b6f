"""What a diagnosis says: findings, accounts of energy, what they are worth on trips never fitted."""
