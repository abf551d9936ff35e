"""Commands for people who prepare, test and calibrate a rover. No module that flies imports them."""
