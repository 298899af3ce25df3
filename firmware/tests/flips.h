// One flipped bit of an SPI transfer between controller and chip, for tests that try each.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>

#include "../sim/src/tle5012b_chip.h"
#include "../sim/src/tmc5130_chip.h"

namespace flips {

constexpr int kNone = -1;
// Of a datagram with the driver: 40 as it arrives there, 40 of its answer.
constexpr int kDatagram = 80;
// Ticks in which the driver writes each setting again at least once.
constexpr int kRound = 15 * 16 * 16 + 16;

template <std::size_t size>
void flip(std::uint8_t (&bytes)[size], int bit) {
  bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ 0x80 >> bit % 8);
}

inline void exchange(bioscara::sim::Tmc5130Chip& chip, const std::uint8_t (&sent)[5],
                     std::uint8_t (&received)[5], int bit) {
  std::uint8_t arriving[5];
  std::copy_n(sent, 5, arriving);
  if (bit != kNone && bit < 40) flip(arriving, bit);
  chip.exchange(arriving, received);
  if (bit >= 40) flip(received, bit - 40);
}

// Of the encoder's command and so many words.
constexpr int encoder_bits(std::size_t words) { return 16 * (1 + static_cast<int>(words)); }

inline void exchange(bioscara::sim::Tle5012bChip& chip, std::uint16_t command, std::uint16_t* words,
                     std::size_t count, int bit) {
  const auto spoil = [bit](int word) {
    return bit != kNone && bit / 16 == word ? 0x8000U >> bit % 16 : 0U;
  };
  const auto arriving = static_cast<std::uint16_t>(command ^ spoil(0));
  const bool writes = (command & 0x8000) == 0;
  std::uint16_t lines[16] = {};
  for (std::size_t i = 0; i < count; ++i)
    lines[i] = static_cast<std::uint16_t>(words[i] ^ (writes ? spoil(static_cast<int>(i) + 1) : 0U));
  chip.exchange(arriving, lines, count);
  if (writes) return;
  for (std::size_t i = 0; i < count; ++i)
    words[i] = static_cast<std::uint16_t>(lines[i] ^ spoil(static_cast<int>(i) + 1));
}

// Each bit of each kind of datagram with the driver, one after the other as they come. The first byte is
// the kind.
class Each {
 public:
  // The bit of this datagram to be flipped, of the first `bits`; none before go_on().
  int next(const std::uint8_t (&sent)[5], int bits) {
    ++idle_;
    int& bit = tried_[sent[0]];
    if (!ready_ || bit == bits) return kNone;
    ready_ = false;
    idle_ = 0;
    last_ = sent[0];
    return bit++;
  }
  void go_on() { ready_ = true; }
  // No datagram of a whole round had a bit left.
  bool done() const { return idle_ > 6 * kRound; }
  std::size_t kinds() const { return tried_.size(); }
  std::uint8_t last() const { return last_; }
  int last_bit() const { return tried_.at(last_) - 1; }

 private:
  std::map<std::uint8_t, int> tried_;
  bool ready_ = false;
  long idle_ = 0;
  std::uint8_t last_ = 0;
};

}  // namespace flips
