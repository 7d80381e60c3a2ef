#include "client/vehicle/sent_atlas.h"

#include <utility>

#include "client/vehicle/atlas_folder.h"
#include "client/vehicle/stored_file.h"

namespace atlas {
namespace {

// Frozen.
constexpr std::uint32_t kMagic = 0x53564152;  // "RAVS"
constexpr std::uint8_t kVersion = 1;

constexpr std::size_t kMaxBytes = 4096;

}  // namespace

SentAtlas::SentAtlas(const std::filesystem::path& folder) : path_(folder / kSentAtlasFileName) {}

bool SentAtlas::IsAnother(const AtlasIdentity& atlas) {
  if (!is_read_) Read();
  if (!last_) Note(atlas);
  const std::optional<State> now = StateOf(atlas);
  return now && now != last_;
}

void SentAtlas::Note(const AtlasIdentity& atlas) {
  const std::optional<State> now = StateOf(atlas);
  if (!now || now == last_) return;
  last_ = now;
  if (!is_read_) return;
  const Status status = StoreFile(path_, Encode(*now), Durability::kOnDevice);
  if (problem_.ok()) problem_ = status;
}

Status SentAtlas::TakeProblem() {
  return std::exchange(problem_, Status());
}

void SentAtlas::Read() {
  const Result<Bytes> file = LoadFile(path_, kMaxBytes);
  Result<State> state = file ? Decode(*file) : Result<State>(Error(file.error()));
  const StatusCode code = state ? StatusCode::kOk : state.error().code();
  is_read_ = state || code == StatusCode::kNotFound || code == StatusCode::kInvalidData;
  if (state) last_ = *std::move(state);
  if (!state && code != StatusCode::kNotFound && problem_.ok()) problem_ = state.error();
}

std::optional<SentAtlas::State> SentAtlas::StateOf(const AtlasIdentity& atlas) {
  if (atlas.atlas_id.size() != kAtlasIdBytes) return std::nullopt;
  return State{atlas.atlas_id, atlas.epoch};
}

Bytes SentAtlas::Encode(const State& state) {
  ByteWriter out;
  out.U32(kMagic);
  out.U8(kVersion);
  out.Raw(state.atlas_id);
  out.U64(state.epoch);
  return WithChecksum(out.Take());
}

Result<SentAtlas::State> SentAtlas::Decode(ByteSpan file) {
  const Result<ByteSpan> content = WithoutChecksum(file);
  if (!content) return Error(content.error().WithContext("the atlas that was sent to last"));
  ByteReader in(*content);
  const bool is_ours = in.U32() == kMagic && in.U8() == kVersion;
  const ByteSpan id = in.Raw(kAtlasIdBytes);
  const std::uint64_t epoch = in.U64();
  if (!is_ours || !in.ok() || in.remaining() != 0) {
    return Error(StatusCode::kInvalidData,
                 "the atlas that was sent to last: the file holds something else");
  }
  return State{Bytes(id.begin(), id.end()), epoch};
}

}  // namespace atlas
