"""One operation of the station from its start to its exit code: a script in, news as lines or JSON out."""
