"""The station's archive: one SQLite file, written each turn, queried by time and name, limited in size, exported."""
