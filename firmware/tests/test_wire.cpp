// Frames: which are executed, which are refused, and how they are answered.
#include <limits>

#include "bench.h"
#include "client.h"
#include "testing.h"

using namespace bioscara;
using bench::Bench;
using client::Bytes;
using client::has;
using client::Host;
using client::packed;

namespace {



Bytes some_payload(const Definition& row) {
  Bytes payload(row.written, 0);
  const float one = 1.0F;
  if (row.written >= 4 && row.code != Register::SETUP && row.code != Register::HOME &&
      row.code != Register::ARM)
    std::memcpy(payload.data(), &one, 4);
  if (row.code == Register::HOME) payload = {1, 11, 30, 10};
  if (row.code == Register::MOVETOEND) payload = {1, 11, 30};
  if (row.code == Register::WATCHDOG) payload = {60, 0};
  if (row.code == Register::SETUP) payload = {20, 20, 0, 0};
  if (row.code == Register::SETCURRENT || row.code == Register::SETHOLDCURRENT) payload = {20};
  return payload;
}

bool reads(const Definition& row) {
  return row.direction == Direction::READ || row.direction == Direction::READ_WRITE;
}

bool writes(const Definition& row) {
  return row.direction != Direction::READ && row.direction != Direction::NONE;
}

// Each frame of version 2 in each of its forms.
template <typename F>
void for_each_frame(F&& use) {
  for (const Definition& row : kDefinitions) {
    if (writes(row)) use(row, some_payload(row));
    if (reads(row)) use(row, Bytes{});
  }
}

}  // namespace

TEST(HZ01_one_and_two_flipped_bits_never_execute) {
  Bench bench(3);
  Host host(bench, 3);
  host.arm_session();
  host.enable();
  bench.run(0.3);
  const double before = bench.driver().field();
  long frames = 0;
  host.clear_fault();
  const unsigned refused_before = host.report().refusals;
  const auto strike = [&](const Bytes& frame) {
    Bytes answer = host.exchange(frame, 14);
    ++frames;
    if (frames % 64 == 0) bench.tick();
  };
  for_each_frame([&](const Definition& row, const Bytes& payload) {
    const Bytes good = host.frame(row.code, payload,
                                  static_cast<std::uint8_t>(host.sequence() + 1));
    const std::size_t bits = good.size() * 8;
    for (std::size_t one = 0; one < bits; ++one) {
      for (std::size_t two = one; two < bits; ++two) {
        Bytes bad = good;
        bad[one / 8] = static_cast<std::uint8_t>(bad[one / 8] ^ 1U << one % 8);
        if (two != one) bad[two / 8] = static_cast<std::uint8_t>(bad[two / 8] ^ 1U << two % 8);
        strike(bad);
      }
    }
    bench.tick();
    host.send(Register::WATCHDOG, {60, 0});
  });
  bench.run(0.3);
  CHECK(frames > 30000);
  // Each one was refused: nothing was executed, and no sequence number was used up.
  CHECK(host.report().refusals == refused_before + frames);
  // The position of the rotor may still be corrected.
  CHECK(std::fabs(bench.driver().field() - before) < 20.0);
  const client::State state = host.state();
  CHECK(state.state == JointState::HOLDING);
  CHECK(!has(state.flags, Flags::NOTENABLED) && !has(state.flags, Flags::FAULT));
  CHECK(host.bare(Register::HOMEOFFSET, {}, 4) == (Bytes{0, 0, 0, 0, 0x04}));
}

TEST(HZ01_a_bare_read_flipped_into_HOME_starts_nothing) {
  Bench bench(1);
  Host host(bench, 1);
  host.enable_bare();
  const double before = bench.driver().field();
  // GETENCODERRPM with its lowest bit flipped; STOP with bit 2.
  CHECK(!has(host.bare(Register::HOME).back(), Flags::BUSY));
  CHECK(!has(host.bare(Register::HOME, {0}).back(), Flags::BUSY));
  bench.run(0.3);
  // The position of the rotor may still be corrected.
  CHECK(std::fabs(bench.driver().field() - before) < 20.0);
  CHECK(host.report().refusal == Refusal::LENGTH);
}

TEST(HZ02_reading_again_executes_nothing) {
  Bench bench(4);
  Host host(bench, 4);
  host.enable_bare();
  const double before = bench.driver().field();
  const Bytes first = host.bare(Register::MOVESTEPS, packed(std::int32_t{4000}));
  for (int time = 0; time < 200; ++time) {
    CHECK(host.exchange({}, 1) == first);  // A bare read: the same answer.
    bench.run(0.005);
    host.bare(Register::PING, {}, 1);
    host.bare(Register::MOVESTEPS, {});  // Cut short: not a command.
  }
  CHECK(std::fabs(bench.driver().field() - before - 4000.0) < 64.0);
}

TEST(HZ03_a_repeated_relative_move_is_made_once) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable();
  bench.run(0.2);
  const double before = bench.driver().field();
  const Bytes frame = host.frame(Register::MOVESTEPS, packed(std::int32_t{4000}),
                                 host.next_sequence());
  const Bytes first = host.exchange(frame, 3);
  for (int time = 0; time < 5; ++time) {
    bench.tick();
    CHECK(host.exchange(frame, 3) == first);
  }
  // A late copy, after a newer frame.
  host.keep(0.3);
  CHECK(has(host.raw(frame)[0], Flags::REFUSED));
  CHECK(host.report().refusal == Refusal::OLD_SEQUENCE);
  host.keep(0.3);
  CHECK(std::fabs(bench.driver().field() - before - 4000.0) < 64.0);
}

TEST(a_late_copy_of_ARM_does_not_rewind_the_sequence) {
  Bench bench(4);
  Host host(bench, 4);
  const Bytes hello = host.hello();
  const Bytes arm = host.frame(Register::ARM, {hello[6], hello[7], 1, 0}, host.next_sequence());
  CHECK(!has(host.raw(arm)[0], Flags::REFUSED));
  host.enable();
  const Bytes move = host.frame(Register::MOVESTEPS, packed(std::int32_t{400}),
                                host.next_sequence());
  CHECK(!has(host.raw(move)[0], Flags::REFUSED));
  host.keep(0.2);
  CHECK(!has(host.raw(arm)[0], Flags::REFUSED));
  CHECK(has(host.raw(move)[0], Flags::REFUSED));
  CHECK(has(host.send(Register::ARM, {0, 0, 2, 0})[0], Flags::REFUSED));
  CHECK(host.report().refusal == Refusal::WRONG_BOOT);
}

TEST(a_late_copy_of_an_earlier_ARM_does_not_bring_its_session_back) {
  Bench bench(4);
  Host host(bench, 4);
  const Bytes hello = host.hello();
  const auto open = [&](int session) {
    return host.frame(Register::ARM,
                      {hello[6], hello[7], static_cast<std::uint8_t>(session), 0},
                      host.next_sequence());
  };
  const Bytes first = open(1);
  host.raw(first);
  host.enable();
  const Bytes move = host.frame(Register::MOVESTEPS, packed(std::int32_t{400}),
                                host.next_sequence());
  for (int session = 2; session <= 32; ++session) {
    CHECK(!has(host.raw(open(session))[0], Flags::REFUSED));
    CHECK(has(host.raw(first)[0], Flags::REFUSED));
    CHECK(host.report().refusal == Refusal::OLD_SEQUENCE);
    CHECK(has(host.raw(move)[0], Flags::REFUSED));
  }
  // The session that is open goes on, with its own numbers.
  CHECK(!has(host.turn(1.0), Flags::REFUSED));
}

TEST(the_last_answer_is_kept_through_whatever_comes_between_it_and_its_repetition) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable();
  const Bytes old = host.frame(Register::WATCHDOG, {}, host.next_sequence());
  host.exchange(old, 5);
  const Bytes frame = host.frame(Register::ANGLEMOVED, {}, host.next_sequence());
  const Bytes answer = host.exchange(frame, 7);
  Bytes damaged = host.frame(Register::STATE, {}, host.sequence());
  damaged.back() ^= 1;
  const Bytes other = host.frame(Register::STATE, {}, host.sequence());
  const Bytes hello = host.frame(Register::HELLO, {}, host.sequence());
  for (const Bytes& between : {damaged, old, other, hello, Bytes{0x0F}, Bytes{0xAA, 1, 2}}) {
    host.exchange(between, 13);
    bench.tick();
    CHECK(host.exchange(frame, 7) == answer);
  }
  // Another register with that number is no repetition.
  const unsigned refusals = host.report().refusals;
  const Bytes last = host.frame(Register::STATE, {}, host.sequence());
  CHECK(has(host.exchange(last, 3)[0], Flags::REFUSED));
  CHECK(host.report().refusal == Refusal::OLD_SEQUENCE);
  CHECK(host.report().refusals == refusals + 1);
}

TEST(HELLO_is_answered_with_any_number_and_uses_none_up) {
  Bench bench(4);
  Host host(bench, 4);
  // The first frame after a boot may have any number, too.
  CHECK(!has(host.raw(host.frame(Register::STATE, {}, 200), 10).back(), Flags::REFUSED));
  host.arm_session();
  for (int ahead : {-50, 0, 50}) {
    const auto number = static_cast<std::uint8_t>(host.sequence() + ahead);
    const Bytes answer = host.raw(host.frame(Register::HELLO, {}, number), 10);
    CHECK(load<std::uint16_t>(&answer[0]) == kMagic);
  }
  CHECK(!has(host.state().flags, Flags::REFUSED));
}

TEST(a_read_of_what_is_only_written_is_refused_and_so_is_a_bare_one_of_version_2) {
  Bench bench(4);
  Host host(bench, 4);
  for (const Definition& row : kDefinitions) {
    // A SETUP of version 1 may have two bytes, as many as a trailer.
    if (row.direction == Direction::NONE || row.code == Register::SETUP) continue;
    const unsigned before = host.report().refusals;
    if (!reads(row)) {
      CHECK(has(host.send(row.code)[0], Flags::REFUSED));
      CHECK(host.report().refusal == Refusal::DIRECTION);
    } else if (row.version == 2) {
      CHECK(host.bare(row.code) == Bytes{0x0C});
      CHECK(host.report().refusal == Refusal::LENGTH);
    } else {
      continue;
    }
    CHECK(host.report().refusals == before + 1U);
  }
}

TEST(a_probe_of_the_address_and_a_single_byte_are_survived) {
  for (int joint = 1; joint <= 4; ++joint) {
    Bench bench(joint);
    Host host(bench, joint);
    host.bare(Register::PING, {}, 1);
    bench.probe();
    CHECK(host.exchange({}, 2) == (Bytes{0xFF, 0xFF}));
    // One byte that is a check byte by chance is no frame of version 2.
    const auto start = static_cast<std::uint8_t>(host.address() << 1);
    const std::uint8_t byte = crc8(0, &start, 1);
    CHECK(host.exchange({byte}, 3)[1] == 0xFF);
  }
}

TEST(what_a_command_changes_shows_in_its_answer_and_holds_for_the_next_of_its_tick) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  CHECK(has(host.send(Register::SETUP, {20, 20, 0, 0})[0], Flags::BUSY));
  host.wait_until_idle();
  const auto refused = [&](Refusal reason) {
    return has(host.turn(1.0), Flags::REFUSED) && host.report().refusal == reason;
  };
  const std::uint8_t homing = host.send(Register::HOME, {1, 11, 30, 10})[0];
  CHECK(has(homing, Flags::BUSY) && has(homing, Flags::NOTHOMED));
  CHECK(refused(Refusal::BUSY));
  CHECK(!has(host.send(Register::STOP, {0})[0], Flags::BUSY));
  CHECK(!has(host.turn(1.0), Flags::REFUSED));
  host.keep(0.1);
  CHECK(has(host.send(Register::DISABLECLOSEDLOOP, {0})[0], Flags::NOTENABLED));
  CHECK(refused(Refusal::NOT_ENABLED));
  host.keep(0.5);
  // An open stage that is closed again: the rotor settles first.
  host.send(Register::SETHOLDCURRENT, {0});
  host.keep(0.5);
  CHECK(!bench.stage_closed());
  CHECK(has(host.send(Register::SETUP, {20, 20, 0, 0})[0], Flags::BUSY));
  host.wait_until_idle();
  // Current flows after a fault of silence: acknowledged, engaged and moved within a tick.
  host.turn(5.0);
  bench.run(1.0);
  CHECK(host.fault() == Fault::SETPOINT_LOST);
  CHECK(host.state().state == JointState::FAULTED);
  CHECK(host.bare(static_cast<Register>(0xAA)) == Bytes{0x0C});  // No bits of version 2.
  CHECK(!has(host.send(Register::CLEARFAULT, {static_cast<std::uint8_t>(host.fault())})[0],
             Flags::FAULT));
  CHECK(host.send(Register::SETUP, {20, 20, 0, 0})[0] == (Flags::NOTHOMED | Flags::ARMED));
  CHECK(!has(host.turn(5.0), Flags::REFUSED));
  host.keep(0.1);
  CHECK(bench.field_speed() > 4.9);
}

TEST(a_command_that_arrives_while_a_tick_runs_stays_BUSY) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable();
  host.turn(5.0);
  bench.tick();
  bool arrived = false;
  bench.interrupt([&] {
    arrived = true;
    CHECK(has(host.send(Register::HOME, {1, 11, 30, 10})[0], Flags::BUSY));
  });
  bench.tick();
  CHECK(arrived);
  CHECK(has(host.bare(Register::PING, {}, 1).back(), Flags::BUSY));
}

TEST(setpoints_of_one_tick_replace_each_other_and_nothing_else) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable();
  const float start = static_cast<float>(host.degrees());
  host.send(Register::SETCONTROLTHRESHOLD, packed(20.0F));
  for (int time = 0; time < 50; ++time)
    CHECK(!has(host.send(Register::TRACK, client::setpoint(start, 0.0F), 6).back(),
               Flags::REFUSED));
}

TEST(TRACKLOAD_is_TRACK_with_the_load_of_STATE_in_its_answer) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  CHECK(has(host.send(Register::TRACKLOAD, client::setpoint(0.0F, 0.0F))[0], Flags::REFUSED));
  host.enable();
  const float start = static_cast<float>(host.degrees());
  int most = 0;
  for (int step = 1; step <= 100; ++step) {
    // Each of the two takes over where the other was.
    const Register code = step % 2 == 0 ? Register::TRACK : Register::TRACKLOAD;
    const std::size_t size = step % 2 == 0 ? 6 : 7;
    const float place = start + 0.02F * static_cast<float>(step * step);
    const Bytes answer = host.send(code, client::setpoint(place, 0.333F * static_cast<float>(step)), size);
    CHECK(!has(answer.back(), Flags::REFUSED));
    const client::State state = host.state();
    CHECK(state.state == JointState::TRACKING || step == 1);
    CHECK(load<float>(answer.data()) == state.degrees);
    if (size == 7) {
      CHECK(answer[6] == state.load_percent);
      most = std::max<int>(most, state.load_percent);
    }
    bench.run(0.02);
  }
  CHECK(most > 0 && most <= 100);
  CHECK(std::fabs(host.degrees() - start - 200.0) < 5.0);
  CHECK(host.fault() == Fault::NONE);
}

TEST(HZ07_lengths_of_0_to_64_bytes_are_survived_and_only_whole_frames_executed) {
  Bench bench(1);
  Host host(bench, 1);
  host.arm_session();
  host.enable();
  bench.run(0.2);
  const double before = bench.driver().field();
  for (int code = 0; code < 256; ++code) {
    if (static_cast<Register>(code) == Register::STOP) continue;
    for (std::size_t size = 0; size <= 64; ++size) {
      Bytes frame(size, 0x5A);
      if (size > 0) frame[0] = static_cast<std::uint8_t>(code);
      host.exchange(frame, 14);
    }
    bench.tick();
  }
  // Whole but for one byte, in both versions: never padded with earlier bytes.
  for_each_frame([&](const Definition& row, const Bytes& payload) {
    if (payload.size() < 2 || row.code == Register::SETUP) return;
    const Bytes shorter(payload.begin(), payload.end() - 1);
    Bytes longer = payload;
    longer.push_back(0);
    CHECK(has(host.send(row.code, shorter)[0], Flags::REFUSED));
    CHECK(has(host.send(row.code, longer)[0], Flags::REFUSED));
  });
  bench.run(0.2);
  // The position of the rotor may still be corrected.
  CHECK(std::fabs(bench.driver().field() - before) < 20.0);
  CHECK(host.state().state == JointState::HOLDING);
}

TEST(HZ08_unknown_registers_are_refused_and_counted) {
  Bench bench(2);
  Host host(bench, 2);
  unsigned expected = host.report().refusals;
  for (int code = 0; code < 256; ++code) {
    bool known = false;
    for (const Definition& row : kDefinitions)
      known = known || (static_cast<int>(row.code) == code && row.direction != Direction::NONE);
    if (known) continue;
    // Version 1: the flags alone, with none set that was clear.
    CHECK(host.bare(static_cast<Register>(code), {1}) == Bytes{0x0C});
    CHECK(host.report().refusals == ++expected);
    CHECK(has(host.send(static_cast<Register>(code), {1, 2, 3, 4})[0], Flags::REFUSED));
    CHECK(host.report().refusals == ++expected);
    CHECK(host.report().refusal == Refusal::UNKNOWN_REGISTER);
    bench.tick();
    CHECK(!has(host.flags(), Flags::BUSY));
  }
}

TEST(HZ09_an_interrupt_talks_to_no_chip_and_the_answer_is_there_at_once) {
  Bench bench(3);
  Host host(bench, 3);
  host.arm_session();
  host.enable();
  for_each_frame([&](const Definition& row, const Bytes& payload) {
    const Bytes bytes = host.frame(row.code, payload, host.next_sequence());
    const Bytes answer = host.exchange(bytes, 13);
    // The trailer is in its place before any tick has run.
    const std::size_t whole = row.read + 3U;
    const auto start = static_cast<std::uint8_t>(host.address() << 1 | 1);
    CHECK(crc8(crc8(0, &start, 1), answer.data(), whole) == 0 ||
          crc8(crc8(0, &start, 1), answer.data(), 3) == 0);
    bench.tick();
  });
  CHECK(bench.interrupt_exchanges() == 0);
  CHECK(bench.foretold() > 40 && bench.mistaken() == 0);
}

TEST(what_is_judged_as_it_arrives_is_what_is_judged_at_its_end) {
  // The same frames to two joints, one of which sees them only whole.
  Bench early(3), late(3);
  late.judge_early(false);
  Host first(early, 3), second(late, 3);
  for (client::Host<Bench>* host : {&first, &second}) {
    host->arm_session();
    host->enable();
  }
  const int before = late.foretold();
  for_each_frame([&](const Definition& row, const Bytes& payload) {
    const Bytes bytes = first.frame(row.code, payload, first.next_sequence());
    for (std::size_t size = 1; size <= bytes.size() + 2; ++size) {
      Bytes part = bytes;
      part.resize(size);
      CHECK(first.exchange(part, 13) == second.exchange(part, 13));
    }
    early.tick();
    late.tick();
  });
  CHECK(late.foretold() == before);
}

TEST(HZ13_HELLO_tells_which_joint_it_is) {
  for (int joint = 1; joint <= 4; ++joint) {
    Bench bench(joint);
    Host host(bench, joint);
    const Bytes hello = host.hello();
    CHECK(load<std::uint16_t>(&hello[0]) == kMagic);
    CHECK(hello[2] == kProtocolVersion);
    CHECK(hello[5] == joint);
    CHECK(bench.configuration().address == host.address());
    CHECK(hello[8] == static_cast<std::uint8_t>(ResetCause::POWER_ON));
    bench.boot(ResetCause::BROWN_OUT);
    const Bytes again = host.hello();
    CHECK(again[8] == static_cast<std::uint8_t>(ResetCause::BROWN_OUT));
    CHECK(load<std::uint16_t>(&again[6]) != load<std::uint16_t>(&hello[6]));
    CHECK(has(again[10], Flags::NOTHOMED) && has(again[10], Flags::NOTENABLED));
    CHECK(!has(again[10], Flags::ARMED));
  }
}

TEST(a_frame_for_another_joint_is_refused) {
  Bench bench(4);
  Host host(bench, 4);
  Host neighbour(bench, 3);
  host.arm_session();
  host.enable();
  // The bytes of joint 3 arrive at joint 4: the address is part of the check.
  const Bytes frame = neighbour.frame(Register::SETRPM, packed(20.0F), host.next_sequence());
  host.exchange(frame, 3);
  CHECK(host.report().refusal == Refusal::CRC);
  CHECK(host.report().crc_errors == 1);
  CHECK(host.state().state == JointState::HOLDING);
}

TEST(numbers_that_are_not_finite_or_out_of_range_are_refused) {
  Bench bench(1);
  Host host(bench, 1);
  host.arm_session();
  host.enable();
  const double before = bench.driver().field();
  constexpr float kNever = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinite = std::numeric_limits<float>::infinity();
  for (float number : {kNever, kInfinite, -kInfinite}) {
    for (const Definition& row : kDefinitions) {
      const bool number_register =
          writes(row) && row.written == 4 && row.code != Register::SETUP &&
          row.code != Register::HOME && row.code != Register::ARM &&
          row.code != Register::MOVESTEPS;
      if (!number_register) continue;
      CHECK(has(host.send(row.code, packed(number))[0], Flags::REFUSED));
      CHECK(host.report().refusal == Refusal::NOT_FINITE);
    }
    CHECK(has(host.send(Register::TRACK, client::setpoint(number, 0.0F), 6)[0], Flags::REFUSED));
    CHECK(host.report().refusal == Refusal::NOT_FINITE);
  }
  const auto out_of_range = [&](Register code, const Bytes& payload) {
    CHECK(has(host.send(code, payload)[0], Flags::REFUSED));
    CHECK(host.report().refusal == Refusal::OUT_OF_RANGE);
  };
  for (Register code : {Register::SETRPM, Register::MOVEANGLE, Register::MOVETOANGLE,
                        Register::HOMEOFFSET}) {
    out_of_range(code, packed(std::nextafter(1e7F, kInfinite)));
    out_of_range(code, packed(std::nextafter(-1e7F, -kInfinite)));
    out_of_range(code, packed(-3e38F));
  }
  constexpr float kLeast = std::numeric_limits<float>::denorm_min();
  for (Register code : {Register::SETMAXVELOCITY, Register::SETMAXACCELERATION,
                        Register::SETMAXDECELERATION, Register::SETCONTROLTHRESHOLD})
    out_of_range(code, packed(-kLeast));
  out_of_range(Register::CHECKORIENTATION, packed(std::nextafter(10.0F, 11.0F)));
  out_of_range(Register::CHECKORIENTATION, packed(0.0F));
  out_of_range(Register::CHECKORIENTATION, packed(-0.0F));
  out_of_range(Register::MOVETOEND, {1, 251, 30});
  out_of_range(Register::SETUP, {101, 20, 0, 0});
  out_of_range(Register::SETUP, {20, 101, 0, 0});
  out_of_range(Register::SETCURRENT, {101});
  out_of_range(Register::SETHOLDCURRENT, {101});
  out_of_range(Register::SETBRAKEMODE, {3});
  out_of_range(Register::STOP, {2});
  out_of_range(Register::RUNCONTINUOUS, {2});
  out_of_range(Register::HOME, {2, 11, 30, 10});
  out_of_range(Register::HOME, {1, 0, 30, 10});
  out_of_range(Register::HOME, {1, 251, 30, 10});
  out_of_range(Register::HOME, {1, 11, 30, 101});
  out_of_range(Register::MOVETOEND, {2, 11, 30});
  out_of_range(Register::MOVETOEND, {1, 0, 30});
  out_of_range(Register::WATCHDOG, packed(std::uint16_t{9}));
  out_of_range(Register::WATCHDOG, packed(std::uint16_t{201}));
  out_of_range(Register::WATCHDOG, packed(std::uint16_t{256 + 60}));
  out_of_range(Register::CLEARFAULT, {static_cast<std::uint8_t>(Fault::STALL)});
  bench.run(0.2);
  // The position of the rotor may still be corrected.
  CHECK(std::fabs(bench.driver().field() - before) < 20.0);
}

TEST(numbers_at_their_limits_are_accepted) {
  constexpr float kMost = std::numeric_limits<float>::max();
  constexpr float kLeast = std::numeric_limits<float>::denorm_min();
  // A joint that is not enabled judges the values first, and moves nothing.
  const auto accepted = [&](Register code, const Bytes& payload) {
    Bench bench(4);
    Host host(bench, 4);
    host.arm_session();
    host.send(code, payload);
    const Refusal refusal = host.report().refusal;
    CHECK(refusal == Refusal::NONE || refusal == Refusal::NOT_ENABLED);
  };
  for (Register code : {Register::SETRPM, Register::MOVEANGLE, Register::MOVETOANGLE,
                        Register::HOMEOFFSET})
    for (float number : {1e7F, -1e7F}) accepted(code, packed(number));
  for (Register code : {Register::SETMAXVELOCITY, Register::SETMAXACCELERATION,
                        Register::SETMAXDECELERATION, Register::SETCONTROLTHRESHOLD})
    for (float number : {0.0F, -0.0F, kMost}) accepted(code, packed(number));
  for (float number : {kLeast, 10.0F}) accepted(Register::CHECKORIENTATION, packed(number));
  for (std::int32_t steps : {std::numeric_limits<std::int32_t>::min(),
                             std::numeric_limits<std::int32_t>::max()})
    accepted(Register::MOVESTEPS, packed(steps));
  for (int timeout : {10, 200}) accepted(Register::WATCHDOG, packed(static_cast<std::uint16_t>(timeout)));
  for (std::uint8_t percent : {0, 100}) {
    accepted(Register::SETUP, {percent, percent, 255, 255});
    accepted(Register::SETCURRENT, {percent});
    accepted(Register::SETHOLDCURRENT, {percent});
  }
  for (std::uint8_t byte : {0, 1}) {
    accepted(Register::STOP, {byte});
    accepted(Register::RUNCONTINUOUS, {byte});
    accepted(Register::HOME, {byte, 1, 0, 0});
    accepted(Register::HOME, {byte, 250, 255, 100});
    accepted(Register::MOVETOEND, {byte, 1, 128});
    accepted(Register::MOVETOEND, {byte, 250, 255});
    accepted(Register::SETBRAKEMODE, {static_cast<std::uint8_t>(2 * byte)});
    accepted(Register::ENABLESTALLGUARD, {static_cast<std::uint8_t>(255 * byte)});
  }
}

TEST(several_commands_within_a_tick_are_all_executed_and_too_many_refused) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable();
  bench.run(0.2);
  const double before = bench.driver().field();
  for (int time = 0; time < 8; ++time) host.send(Register::MOVESTEPS, packed(std::int32_t{0}));
  CHECK(!has(host.send(Register::SETRPM, packed(60.0F))[0], Flags::REFUSED));
  int refused = 0;
  for (int time = 0; time < 20; ++time)
    if (has(host.turn(6.0), Flags::REFUSED)) ++refused;
  CHECK(refused > 0);
  CHECK(host.report().refusal == Refusal::QUEUE_FULL);
  host.keep(0.3);
  CHECK(bench.driver().field() > before);
  CHECK(!has(host.turn(6.0), Flags::REFUSED));
}

TEST(an_armed_session_refuses_writes_without_trailer_but_never_STOP) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable();
  host.turn(6.0);
  host.keep(0.1);
  for_each_frame([&](const Definition& row, const Bytes& payload) {
    if (payload.empty() || row.version != 1 || row.code == Register::STOP) return;
    host.bare(row.code, payload);
    CHECK(host.report().refusal == Refusal::TRAILER_REQUIRED);
  });
  CHECK(host.state().state == JointState::VELOCITY);
  host.bare(Register::STOP, {0});
  host.keep(0.3);
  CHECK(bench.field_speed() == 0.0);
}

TEST(a_joint_that_speaks_version_2_moves_for_no_frame_without_trailer) {
  const std::pair<Register, Bytes> motions[] = {
      {Register::SETUP, {20, 20, 0, 0}},         {Register::SETUP, {20, 20}},
      {Register::SETRPM, packed(60.0F)},         {Register::MOVESTEPS, packed(4000)},
      {Register::MOVEANGLE, packed(10.0F)},      {Register::MOVETOANGLE, packed(10.0F)},
      {Register::RUNCONTINUOUS, {1}},            {Register::MOVETOEND, {1, 20, 30}},
      {Register::CHECKORIENTATION, packed(5.0F)}, {Register::HOME, {1, 11, 30, 10}}};
  for (const auto& [code, payload] : motions) {
    Bench bench(4);
    Host host(bench, 4);
    host.enable_bare();
    CHECK(!has(host.bare(Register::PING, {}, 1).back(), Flags::NOTENABLED));
    // A damaged greeting is none.
    Bytes greeting = host.frame(Register::HELLO, {}, 7);
    greeting.back() ^= 1;
    host.exchange(greeting, 13);
    host.bare(Register::MOVESTEPS, packed(4000));
    bench.run(0.3);
    const double field = bench.field();
    CHECK(field > 0.4);
    for (int time = 0; time < 2; ++time) {
      host.hello();
      const std::uint16_t refused = host.report().refusals;
      host.bare(code, payload);
      bench.run(0.5);
      CHECK(host.report().refusals == refused + 1);
      CHECK(host.report().refusal == Refusal::TRAILER_REQUIRED);
      CHECK(host.state().state == JointState::HOLDING);
      // With a gap: the joint is used as long as it hears such frames.
      bench.run(9.0);
    }
    CHECK(std::fabs(bench.field() - field) < 0.01);
    // Settings do not move it, and STOP always stops.
    host.bare(Register::SETMAXVELOCITY, packed(1000.0F));
    host.turn(5.0);
    bench.run(0.05);
    CHECK(bench.field_speed() > 4.0);
    host.bare(Register::STOP, {0});
    bench.run(0.2);
    CHECK(bench.field_speed() == 0.0);
    CHECK(host.fault() == Fault::NONE);
  }
}

TEST(a_greeting_from_before_does_not_lock_a_host_of_version_1_out) {
  for (bool disarmed : {true, false}) {
    for (double wait : {9.9, 10.1}) {
      // The microseconds overflow in that time.
      Bench bench(4, 0U - 5000000U);
      Host host(bench, 4);
      const Bytes answer = host.hello();
      if (disarmed) host.send(Register::DISARM, {answer[6], answer[7]});
      bench.run(disarmed ? 0.01 : wait);
      host.enable_bare();
      const bool enabled = !has(host.bare(Register::PING, {}, 1).back(), Flags::NOTENABLED);
      CHECK(enabled == (disarmed || wait > 10.0));
      if (disarmed) break;
    }
  }
}

TEST(counters_saturate) {
  Bench bench(4);
  Host host(bench, 4);
  for (long time = 0; time < 70000; ++time) host.exchange({0xAA, 1}, 1);
  CHECK(host.report().refusals == 0xFFFF);
}
