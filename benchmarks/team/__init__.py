"""Teams on one air: routes that heal, chains, and what all of it costs."""
