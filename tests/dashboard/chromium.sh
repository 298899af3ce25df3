#!/bin/sh
# Chromium, which as root would raise its priority (nice -8) above that of the arms beside it: their
# loops would be late. For any other user it has no such priority either.
chromium=$(command -v chromium || command -v chromium-browser)
drop="setpriv --bounding-set -sys_nice --inh-caps -sys_nice"
if [ "$(id -u)" = 0 ] && $drop true 2>/dev/null; then
  exec $drop "$chromium" "$@"
fi
exec "$chromium" "$@"
