"""Controllers and who runs them: measured states come in, bounded commands go out, each cycle.

``controller`` is what every controller is, then one file for each; ``manager`` owns them, with
``claims`` (who may command what), ``switching`` (what a request comes to) and ``schedule`` (who
is due); ``limiting`` is the last stage before the bus.
"""
