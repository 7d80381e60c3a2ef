// Surveys of a tile on the daemon's disk: the file, and the bytes in it.
#include <algorithm>
#include <fstream>
#include <iterator>

#include "core/base/hash.h"
#include "core/fusion/tile_surveys.h"
#include "server/service/fusion/survey_file.h"
#include "tests/core/support/golden_profile.h"
#include "tests/core/support/keyframe_worlds.h"
#include "tests/fuzz/support/packed_mutator.h"
#include "tests/fuzz/support/scratch_folder.h"

namespace atlas::fuzz {
namespace {

constexpr std::size_t kFieldBytes = 48;  // survey_file.cc: what is before the payload's size
constexpr std::size_t kHeaderBytes = 64;
constexpr TileId kTile{0, 0, 0};

MapProfile Profile() {
  return testing::GoldenProfile();
}

Bytes SurveysOf(std::uint32_t frames) {
  const MapProfile profile = Profile();
  const SigmaTable sigmas(profile, 16);
  TileSurveys surveys(kTile);
  TileChange change;
  std::vector<PlacedKeyframe> placed;
  for (std::uint32_t i = 0; i < frames; ++i) {
    placed.push_back(testing::PlacedFrame({"car", i < 2 ? "day" : "night", i},
                                          {1.0, 1.0 + i, 1.8, 30.0 * i},
                                          testing::RandomKeyframe(profile, 4, i)));
    change.present.push_back(
        {placed[i].key, placed[i].time_ms, placed[i].placement, placed[i].keyframe->grid, i});
  }
  const FusionContext context{profile, sigmas};
  for (const FrameOnMap& frame : surveys.Expect(change, context)) {
    surveys.Add(frame, *placed[frame.content].keyframe, context);
  }
  surveys.Combine(context);
  return surveys.Save();
}

// What is missing of a header is 0.
Bytes Pack(ByteSpan flat) {
  Bytes fields(flat.begin(),
               flat.begin() + static_cast<std::ptrdiff_t>(std::min(flat.size(), kFieldBytes)));
  fields.resize(kFieldBytes);
  const ByteSpan payload = flat.subspan(std::min(flat.size(), kFieldBytes));
  ByteWriter out;
  out.Raw(fields);
  out.U64(payload.size());
  out.U64(Hash64(out.bytes()) ^ Hash64(payload));
  out.Raw(payload);
  return out.Take();
}

std::optional<Bytes> Unpack(ByteSpan file) {
  if (file.size() < kHeaderBytes) {
    return std::nullopt;
  }
  ByteWriter flat;
  flat.Raw(file.first(kFieldBytes));
  flat.Raw(file.subspan(kHeaderBytes));
  return flat.Take();
}

std::vector<Bytes> Seeds() {
  std::vector<Bytes> seeds;
  for (const std::uint32_t frames : {1U, 4U}) {
    const ScratchFolder folder;
    const Bytes payload = SurveysOf(frames);
    const auto path = folder.path() / "tile";
    Require(WriteSurveyFile(path, folder.path() / "new",
                            {7, {1, 2, 3}, 9, kTile.Key(), payload.size()}, payload)
                .ok(),
            "surveys are written");
    std::ifstream in(path, std::ios::binary);
    seeds.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  return seeds;
}

bool Run(ByteSpan input) {
  static const ScratchFolder kFolder;
  const auto path = kFolder.Write("tile", input);
  const auto header = ReadSurveyFileHeader(path);
  if (!header) {
    return false;
  }
  const auto payload = ReadSurveyFile(path, *header);
  if (!payload) {
    return false;
  }
  Require(payload->size() == header->payload_bytes, "a file holds what its header says");
  const auto surveys = TileSurveys::Load(*payload, kTile, Profile());
  return surveys.has_value();
}

Bytes Mutate(ByteSpan input, std::size_t max_size, Random& random) {
  return MutatePacked(input, max_size, random, {&Unpack, &Pack, nullptr});
}

}  // namespace

const Target kTarget{&Seeds, &Run, &Mutate};

}  // namespace atlas::fuzz
