#include "core/fusion/column_evidence.h"

#include <algorithm>
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
void AddLanes(Lanes added, const EvidenceClamp& clamp, std::int16_t* evidence) {
  const Lanes before = Load(evidence);
  const Lanes usual = Lanes{} - clamp.usual;
  const Lanes reached = before < usual ? before : usual;  // a mere miss goes no deeper
  const Lanes sum = Clamped(before + added, reached, Lanes{} + clamp.usual);
  Store(added == Lanes{} + EvidenceOfState(kNibbleFree) ? Lanes{} - clamp.driven : sum, evidence);
}

// Eight nibbles from nibble `first` on, those outside 0.
std::uint32_t NibblesFrom(std::uint64_t nibbles, std::int64_t first) {
  if (first >= 16 || first <= -8) {
    return 0;
  }
  return static_cast<std::uint32_t>(first >= 0 ? nibbles >> (4 * first) : nibbles << (-4 * first));
}

// Bit k: nibble k is not 0.
std::uint32_t SeenBits(std::uint32_t nibbles) {
  std::uint32_t bits = (nibbles | (nibbles >> 1) | (nibbles >> 2) | (nibbles >> 3)) & 0x1111'1111u;
  bits = (bits | (bits >> 3)) & 0x0303'0303u;
  bits = (bits | (bits >> 6)) & 0x000F'000Fu;
  return (bits | (bits >> 12)) & 0xFFu;
}

}  // namespace

void AddNibbles(std::uint64_t nibbles,
                std::int64_t offset,
                const EvidenceClamp& clamp,
                std::span<std::int16_t> evidence,
                std::uint32_t& seen) {
  for (std::size_t first = 0; first < evidence.size(); first += kLanes) {
    const std::uint32_t here = NibblesFrom(nibbles, static_cast<std::int64_t>(first) - offset);
    if (here != 0) {
      AddLanes(LanesOf(here), clamp, evidence.data() + first);
      seen |= SeenBits(here) << first;
    }
  }
}

std::int16_t FoldEvidence(int sum, int said, const FoldClamp& clamp) {
  if (said == 0) {
    return static_cast<std::int16_t>(sum);
  }
  const int say = std::clamp<int>(said, -clamp.stretch, clamp.stretch);
  const int carried = std::clamp<int>(sum, -clamp.carry, clamp.carry);
  return static_cast<std::int16_t>(std::clamp<int>(carried + say, -clamp.evidence, clamp.evidence));
}

void ColumnSum::Fold(std::span<const std::int16_t> said,
                     std::uint32_t said_seen,
                     std::int64_t offset,
                     const FoldClamp& clamp) {
  // What lies in between is a whole column wherever altitudes agree as they should.
  std::array<std::int16_t, kSegments> column{};
  const auto size = static_cast<std::int64_t>(said.size());
  const std::int64_t begin = std::clamp<std::int64_t>(offset, 0, size);
  const std::int64_t end = std::clamp<std::int64_t>(offset + std::int64_t{kSegments}, begin, size);
  if (begin == end) {
    return;
  }
  std::memcpy(column.data() + (begin - offset), said.data() + begin,
              static_cast<std::size_t>(end - begin) * sizeof(std::int16_t));
  seen_ |= offset >= 0 ? said_seen >> offset : said_seen << -offset;
  const Lanes stretch = Lanes{} + clamp.stretch;
  const Lanes carry = Lanes{} + clamp.carry;
  const Lanes all = Lanes{} + clamp.evidence;
  for (std::size_t half = 0; half < kSegments; half += kLanes) {
    const Lanes says = Load(column.data() + half);
    const Lanes before = Load(evidence_.data() + half);
    const Lanes sum =
        Clamped(Clamped(before, -carry, carry) + Clamped(says, -stretch, stretch), -all, all);
    Store(says == Lanes{} ? before : sum, evidence_.data() + half);
  }
}

std::uint64_t ColumnSum::Nibbles(std::uint64_t mask) const {
  std::uint64_t nibbles = 0;
  for (std::size_t k = 0; k < kSegments; ++k) {
    if (((seen_ >> k) & 1u) != 0) {
      nibbles |= std::uint64_t{NibbleFromEvidence(evidence_[k])} << (4 * k);
    }
  }
  return nibbles & mask;
}

}  // namespace atlas
