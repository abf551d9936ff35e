"""The space link: datagrams, keys, transactions, events, bulk objects."""
