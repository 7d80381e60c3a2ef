#include "core/fusion/segment/column_evidence.h"

#include <bit>

#include "core/base/integer_math.h"
#include "core/geometry/nibble.h"

namespace atlas {
namespace {

static_assert(std::endian::native == std::endian::little, "lanes below are packed that way");

// Sixteen segments at a time, in one register where the machine has them.
using Lanes = std::int8_t __attribute__((vector_size(16)));

// The evidence of two nibbles, low one in the low half.
constexpr std::array<std::uint16_t, 256> MakePairs() {
  std::array<std::uint16_t, 256> pairs{};
  for (std::size_t byte = 0; byte < pairs.size(); ++byte) {
    const auto low = static_cast<std::uint8_t>(kNibbleEvidence[byte & 15]);
    const auto high = static_cast<std::uint8_t>(kNibbleEvidence[byte >> 4]);
    pairs[byte] = static_cast<std::uint16_t>(low | (high << 8));
  }
  return pairs;
}
constexpr std::array<std::uint16_t, 256> kPairs = MakePairs();

// The evidence of sixteen nibbles.
Lanes LanesOf(std::uint64_t nibbles) {
  std::array<std::uint16_t, 8> pairs{};
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    pairs[i] = kPairs[(nibbles >> (8 * i)) & 255];
  }
  return std::bit_cast<Lanes>(pairs);
}

Lanes All(std::int8_t value) {
  return Lanes{} + value;
}

Lanes Min(Lanes a, Lanes b) {
  return a < b ? a : b;
}

Lanes Max(Lanes a, Lanes b) {
  return a > b ? a : b;
}

// clamp(a + b, -limit, limit) for |a| <= 127, |b| <= limit, without leaving 8 bits: a is brought
// to where the sum stays inside first.
Lanes AddSaturating(Lanes a, Lanes b, Lanes limit) {
  const Lanes highest = limit - Max(b, Lanes{});
  const Lanes lowest = Min(b, Lanes{}) + limit;  // minus it
  return Max(Min(a, highest), -lowest) + b;
}

// Values from `offset` on, 0 beyond them.
Lanes From(const ColumnLanes& lanes, std::int64_t offset) {
  if (offset >= 16 || offset <= -16) {
    return Lanes{};
  }
  const auto bits = std::bit_cast<Uint128>(lanes);
  return std::bit_cast<Lanes>(offset >= 0 ? bits >> (8 * offset) : bits << (-8 * offset));
}

// Bit k: nibble k is not 0.
std::uint16_t SeenBits(std::uint64_t nibbles) {
  std::uint64_t bits =
      (nibbles | (nibbles >> 1) | (nibbles >> 2) | (nibbles >> 3)) & 0x1111'1111'1111'1111;
  bits = (bits | (bits >> 3)) & 0x0303'0303'0303'0303;
  bits = (bits | (bits >> 6)) & 0x000F'000F'000F'000F;
  bits = (bits | (bits >> 12)) & 0x0000'00FF'0000'00FF;
  return static_cast<std::uint16_t>(bits | (bits >> 24));
}

}  // namespace

void AddNibbles(std::uint64_t nibbles,
                std::int64_t offset,
                const EvidenceClamp& clamp,
                ColumnLanes& evidence,
                std::uint16_t& seen) {
  if (offset >= 16 || offset <= -16) {
    return;
  }
  nibbles = offset >= 0 ? nibbles << (4 * offset) : nibbles >> (-4 * offset);
  seen = static_cast<std::uint16_t>(seen | SeenBits(nibbles));
  const Lanes added = LanesOf(nibbles);
  const Lanes before = std::bit_cast<Lanes>(evidence);
  const Lanes usual = All(clamp.usual);
  const Lanes sum = AddSaturating(before, added, usual);
  // Where the vehicle itself was is the last word until released; right above it a mere miss goes
  // no deeper, and a hit adds up.
  const Lanes driven = -All(clamp.driven);
  const Lanes is_deep = before < -usual;
  const Lanes deep = Min(before, Lanes{}) + Max(added, Lanes{});
  const Lanes usually = is_deep ? deep : sum;
  const Lanes is_over = added == All(kNibbleEvidence[kNibbleOver]);
  const Lanes said = is_over ? driven + All(1) : usually;
  const Lanes is_free = added == All(kNibbleEvidence[kNibbleFree]);
  evidence = std::bit_cast<ColumnLanes>(is_free                          ? driven
                                        : (is_deep & (before == driven)) ? before
                                                                         : said);
}

bool SpeakOfVehicle(std::uint64_t nibbles) {
  constexpr std::uint64_t kEach = 0x1111'1111'1111'1111;
  const auto has_zero = [](std::uint64_t n) {
    return ((n - kEach) & ~n & (8 * kEach)) != 0;
  };
  return has_zero(nibbles ^ (kNibbleFree * kEach)) || has_zero(nibbles ^ (kNibbleOver * kEach));
}

void ReleaseDriven(const EvidenceClamp& clamp, ColumnLanes& evidence) {
  evidence = std::bit_cast<ColumnLanes>(Max(std::bit_cast<Lanes>(evidence), -All(clamp.usual)));
}

bool HasValue(const ColumnLanes& evidence, std::int8_t value) {
  const auto is_it = std::bit_cast<Lanes>(evidence) == All(value);
  using Halves = std::array<std::uint64_t, 2>;
  return std::bit_cast<Halves>(is_it) != Halves{};
}

void DropHitsWhere(const ColumnLanes& other,
                   std::int8_t value,
                   std::int64_t offset,
                   ColumnLanes& evidence) {
  const Lanes before = std::bit_cast<Lanes>(evidence);
  const Lanes beside = From(other, offset);
  evidence = std::bit_cast<ColumnLanes>(beside == All(value) ? Min(before, Lanes{}) : before);
}

int FoldEvidence(int sum, int said, const FoldClamp& clamp) {
  if (said == 0) {
    return sum;
  }
  const int say = std::clamp<int>(said, -clamp.stretch, clamp.stretch);
  const int carried = std::clamp<int>(sum, -clamp.carry, clamp.carry);
  return std::clamp<int>(carried + say, -clamp.evidence, clamp.evidence);
}

void ColumnSum::Fold(const ColumnLanes& said,
                     std::uint16_t said_seen,
                     std::int64_t offset,
                     const FoldClamp& clamp) {
  if (offset >= 16 || offset <= -16) {
    return;
  }
  const std::uint32_t seen = said_seen;
  seen_ |= offset >= 0 ? seen >> offset : seen << -offset;
  const Lanes says = From(said, offset);
  const Lanes before = std::bit_cast<Lanes>(evidence_);
  const Lanes evidence_limit = All(clamp.evidence);
  const Lanes say_limit = All(std::min(clamp.stretch, clamp.evidence));
  const Lanes say = Max(Min(says, say_limit), -say_limit);
  const Lanes carry = All(clamp.carry);
  const Lanes sum = AddSaturating(Max(Min(before, carry), -carry), say, evidence_limit);
  evidence_ = std::bit_cast<ColumnLanes>(says == Lanes{} ? before : sum);
}

void ColumnSum::DropWhatStood(const ColumnSum& before,
                              const ColumnLanes& said,
                              std::int64_t offset,
                              std::size_t values) {
  const auto says = std::bit_cast<ColumnLanes>(From(said, offset));
  const std::size_t begin = before.evidence_[0] > 0 ? 0 : 1;
  std::size_t end = begin;
  for (; end < values && before.evidence_[end] > 0; ++end) {
    if (says[end] > 0) {
      return;  // some of it is there
    }
  }
  for (std::size_t k = begin; k < end; ++k) {
    evidence_[k] = std::min<std::int8_t>(evidence_[k], 0);
  }
}

std::uint64_t ColumnSum::Nibbles(std::uint64_t mask) const {
  std::uint64_t nibbles = 0;
  for (std::size_t k = 0; k < evidence_.size(); ++k) {
    if (((seen_ >> k) & 1u) != 0) {
      nibbles |= std::uint64_t{NibbleFromEvidence(evidence_[k])} << (4 * k);
    }
  }
  return nibbles & mask;
}

}  // namespace atlas
