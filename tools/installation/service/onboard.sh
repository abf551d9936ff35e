#!/bin/sh
# -P: nothing is imported from the folder in which it is called
exec @PREFIX@/lib/el-dorado/current/bin/python -P -m onboard "$@"
