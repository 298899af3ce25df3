"""An STM32F401 in virtual time, far enough to run the firmware as it is flashed.

The core is unicorn's; everything around it is modelled here from the reference manual (RM0368), the
programming manual (PM0214) and the data sheets, one module per peripheral. The models follow the
manuals and not the firmware; access to anything else raises, naming it.
"""
