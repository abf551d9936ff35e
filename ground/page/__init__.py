"""The operator's page, `ground serve`: one station session, many browsers, two roles."""
