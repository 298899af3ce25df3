// Addresses of the TMC5130's registers (its data sheet), for the chip and the original joint's
// driver. Our firmware keeps its own list, so that the chip model reveals a wrong address in it.
#pragma once

#include <cstdint>

namespace bioscara::sim::tmc5130 {

enum Address : std::uint8_t {
  GCONF = 0x00,
  GSTAT = 0x01,
  IOIN = 0x04,
  IHOLD_IRUN = 0x10,
  TPOWERDOWN = 0x11,
  TPWMTHRS = 0x13,
  RAMPMODE = 0x20,
  XACTUAL = 0x21,
  VACTUAL = 0x22,
  VSTART = 0x23,
  A1 = 0x24,
  V1 = 0x25,
  AMAX = 0x26,
  VMAX = 0x27,
  DMAX = 0x28,
  D1 = 0x2A,
  VSTOP = 0x2B,
  TZEROWAIT = 0x2C,
  XTARGET = 0x2D,
  VDCMIN = 0x33,
  RAMP_STAT = 0x35,
  MSLUT = 0x60,
  MSLUTSEL = 0x68,
  MSLUTSTART = 0x69,
  CHOPCONF = 0x6C,
  DRV_STATUS = 0x6F,
  PWMCONF = 0x70,
};

}  // namespace bioscara::sim::tmc5130
