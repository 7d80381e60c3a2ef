#include "core/fusion/column_evidence.h"

#include <bit>
#include <cstring>

#include "core/geometry/nibble.h"

namespace atlas {
namespace {

static_assert(std::endian::native == std::endian::little, "lanes below are packed that way");

// Eight segments at a time, in one register where the machine has them.
using Lanes = std::int16_t __attribute__((vector_size(16)));
constexpr std::size_t kLanes = 8;

constexpr std::int16_t EvidenceOfState(std::size_t state) {
  return kNibbleEvidence[state];
}

// The evidence of two nibbles, low one in the low half.
constexpr std::array<std::uint32_t, 256> MakePairs() {
  std::array<std::uint32_t, 256> pairs{};
  for (std::size_t byte = 0; byte < pairs.size(); ++byte) {
    const std::int16_t low = EvidenceOfState(byte & 15);
    const std::int16_t high = EvidenceOfState(byte >> 4);
    pairs[byte] = static_cast<std::uint16_t>(low) |
                  (static_cast<std::uint32_t>(static_cast<std::uint16_t>(high)) << 16);
  }
  return pairs;
}
constexpr std::array<std::uint32_t, 256> kPairs = MakePairs();

// The evidence of eight nibbles.
Lanes LanesOf(std::uint32_t nibbles) {
  const std::array<std::uint64_t, 2> halves = {
      kPairs[nibbles & 255] | (std::uint64_t{kPairs[(nibbles >> 8) & 255]} << 32),
      kPairs[(nibbles >> 16) & 255] | (std::uint64_t{kPairs[nibbles >> 24]} << 32)};
  return std::bit_cast<Lanes>(halves);
}

Lanes Load(const std::int16_t* evidence) {
  Lanes lanes;
  std::memcpy(&lanes, evidence, sizeof(lanes));
  return lanes;
}

void Store(Lanes lanes, std::int16_t* evidence) {
  std::memcpy(evidence, &lanes, sizeof(lanes));
}

Lanes Clamped(Lanes lanes, Lanes low, Lanes high) {
  lanes = lanes > high ? high : lanes;
  return lanes < low ? low : lanes;
}

// Sums stay within 16 bits: |evidence| <= 16384, |added| <= 64.
void AddLanes(Lanes added, const ColumnEvidence::Clamp& clamp, std::int16_t* evidence) {
  const Lanes before = Load(evidence);
  const Lanes usual = Lanes{} - clamp.usual;
  const Lanes reached = before < usual ? before : usual;  // a mere miss goes no deeper
  const Lanes sum = Clamped(before + added, reached, Lanes{} + clamp.usual);
  Store(added == Lanes{} + EvidenceOfState(kNibbleFree) ? Lanes{} - clamp.driven : sum, evidence);
}

}  // namespace

void ColumnEvidence::AddNibbles(std::uint64_t nibbles, const Clamp& clamp) {
  seen |= nibbles;
  AddLanes(LanesOf(static_cast<std::uint32_t>(nibbles)), clamp, evidence.data());
  if ((nibbles >> 32) != 0) {
    AddLanes(LanesOf(static_cast<std::uint32_t>(nibbles >> 32)), clamp, evidence.data() + kLanes);
  }
}

void ColumnEvidence::Add(const ColumnEvidence& other, std::int16_t say, std::int16_t clamp) {
  seen |= other.seen;
  const Lanes all_say = Lanes{} + say;
  const Lanes all_clamp = Lanes{} + clamp;
  for (std::size_t half = 0; half < kSegments; half += kLanes) {
    const Lanes added = Clamped(Load(other.evidence.data() + half), -all_say, all_say);
    Store(Clamped(Load(evidence.data() + half) + added, -all_clamp, all_clamp),
          evidence.data() + half);
  }
}

std::uint64_t NibblesOfEvidence(const ColumnEvidence& column) {
  std::uint64_t nibbles = 0;
  for (std::size_t k = 0; k < ColumnEvidence::kSegments; ++k) {
    if (((column.seen >> (4 * k)) & 15) != 0) {
      nibbles |= std::uint64_t{NibbleFromEvidence(column.evidence[k])} << (4 * k);
    }
  }
  return nibbles;
}

}  // namespace atlas
