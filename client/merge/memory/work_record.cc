#include "client/merge/memory/work_record.h"

#include <bit>

#include "core/alignment/submap_codec.h"

namespace atlas {
namespace {

enum class Kind : std::uint8_t { kSubmap = 1, kMatch, kSearch, kCut, kPair };

constexpr std::size_t kPoseBytes = 12 * 8;
constexpr std::size_t kCutBytes = 2 * 8 + 1;

class Writer {
 public:
  void Add(Kind kind) { out_.U8(static_cast<std::uint8_t>(kind)); }
  void Add(std::uint64_t value) { out_.U64(value); }
  void Add(double value) { out_.U64(std::bit_cast<std::uint64_t>(value)); }
  void Add(const SubmapName& name) {
    Add(name.content);
    Add(name.shape);
  }
  template <typename Matrix>
  void AddMatrix(const Matrix& matrix) {
    for (Eigen::Index i = 0; i < matrix.size(); ++i) {
      Add(static_cast<double>(matrix(i % matrix.rows(), i / matrix.rows())));
    }
  }
  void Add(const Pose& pose) { AddMatrix(pose.matrix().topRows<3>()); }
  void Add(const std::vector<Pose>& poses) {
    out_.U32(static_cast<std::uint32_t>(poses.size()));
    for (const Pose& pose : poses) Add(pose);
  }
  void Add(const std::vector<SubmapPlace>& places) { WritePlaces(places, out_); }
  void Add(const std::vector<SubmapCut>& cuts) {
    out_.U32(static_cast<std::uint32_t>(cuts.size()));
    for (const SubmapCut& cut : cuts) {
      out_.U64(cut.begin);
      out_.U64(cut.end);
      out_.U8(cut.follows_jump ? 1 : 0);
    }
  }
  Bytes Take() { return out_.Take(); }

 private:
  ByteWriter out_;
};

class Reader {
 public:
  explicit Reader(ByteSpan bytes) : in_(bytes) {}

  Kind ReadKind() { return static_cast<Kind>(in_.U8()); }
  std::uint64_t ReadNumber() { return in_.U64(); }
  double ReadDouble() { return std::bit_cast<double>(in_.U64()); }
  SubmapName ReadName() {
    const std::uint64_t content = in_.U64();
    return {content, in_.U64()};
  }
  template <typename Matrix>
  void ReadMatrix(Matrix&& matrix) {
    for (Eigen::Index i = 0; i < matrix.size(); ++i) {
      matrix(i % matrix.rows(), i / matrix.rows()) = ReadDouble();
    }
  }
  Pose ReadPose() {
    Pose pose = Pose::Identity();
    ReadMatrix(pose.matrix().topRows<3>());
    return pose;
  }
  std::vector<Pose> ReadPoses() {
    std::vector<Pose> poses(ReadCount(kPoseBytes), Pose::Identity());
    for (Pose& pose : poses) pose = ReadPose();
    return poses;
  }
  std::vector<SubmapCut> ReadCuts() {
    std::vector<SubmapCut> cuts(ReadCount(kCutBytes));
    for (SubmapCut& cut : cuts) {
      cut.begin = in_.U64();
      cut.end = in_.U64();
      const std::uint8_t follows_jump = in_.U8();
      if (follows_jump > 1) in_.Fail();
      cut.follows_jump = follows_jump != 0;
    }
    return cuts;
  }
  std::optional<Pose> ReadPoseIfThere() {
    const std::vector<Pose> found = ReadPoses();
    if (found.size() > 1) in_.Fail();
    return found.empty() ? std::nullopt : std::optional(found.front());
  }
  std::vector<SubmapPlace> ReadAllPlaces() { return ReadPlaces(in_); }
  bool IsAtEnd() const { return in_.ok() && in_.remaining() == 0; }

 private:
  // As many as there is room for, or none and it has failed.
  std::size_t ReadCount(std::size_t bytes_each) {
    const std::uint32_t count = in_.U32();
    if (count > in_.remaining() / bytes_each) in_.Fail();
    return in_.ok() ? count : 0;
  }

  ByteReader in_;
};

void Write(const SubmapRecord& record, Writer& out) {
  out.Add(Kind::kSubmap);
  out.Add(record.name);
  out.Add(record.T_submap_member);
  out.Add(record.places);
}

SubmapRecord ReadSubmap(Reader& in) {
  SubmapRecord record;
  record.name = in.ReadName();
  record.T_submap_member = in.ReadPoses();
  record.places = in.ReadAllPlaces();
  return record;
}

void Write(const MatchRecord& record, Writer& out) {
  const SubmapMatch& match = record.match;
  out.Add(Kind::kMatch);
  out.Add(record.a);
  out.Add(record.b);
  out.Add(record.T_a_b_start);
  out.Add(match.T_a_b);
  out.AddMatrix(match.information);
  for (const double value :
       {match.fit, match.columns, match.explained, match.sigma_m, match.apart_m, match.apart_rad}) {
    out.Add(value);
  }
}

MatchRecord ReadMatch(Reader& in) {
  MatchRecord record;
  SubmapMatch& match = record.match;
  record.a = in.ReadName();
  record.b = in.ReadName();
  record.T_a_b_start = in.ReadPose();
  match.T_a_b = in.ReadPose();
  in.ReadMatrix(match.information);
  for (double* const value : {&match.fit, &match.columns, &match.explained, &match.sigma_m,
                              &match.apart_m, &match.apart_rad}) {
    *value = in.ReadDouble();
  }
  return record;
}

void Write(const SearchRecord& record, Writer& out) {
  out.Add(Kind::kSearch);
  out.Add(record.a);
  out.Add(record.b);
  out.Add(record.T_a_b_start);
  for (const double value : {record.reach.along_m, record.reach.beside_m, record.reach.yaw_rad,
                             record.reach.direction_rad}) {
    out.Add(value);
  }
  out.Add(record.T_a_b ? std::vector<Pose>{*record.T_a_b} : std::vector<Pose>());
}

SearchRecord ReadSearch(Reader& in) {
  SearchRecord record;
  record.a = in.ReadNumber();
  record.b = in.ReadNumber();
  record.T_a_b_start = in.ReadPose();
  for (double* const value : {&record.reach.along_m, &record.reach.beside_m, &record.reach.yaw_rad,
                              &record.reach.direction_rad}) {
    *value = in.ReadDouble();
  }
  record.T_a_b = in.ReadPoseIfThere();
  return record;
}

void Write(const CutRecord& record, Writer& out) {
  out.Add(Kind::kCut);
  out.Add(record.session);
  out.Add(record.cuts);
}

CutRecord ReadCut(Reader& in) {
  CutRecord record;
  record.session = in.ReadNumber();
  record.cuts = in.ReadCuts();
  return record;
}

void Write(const PairRecord& record, Writer& out) {
  out.Add(Kind::kPair);
  out.Add(record.a);
  out.Add(record.b);
}

PairRecord ReadPair(Reader& in) {
  const std::uint64_t a = in.ReadNumber();
  return {a, in.ReadNumber()};
}

}  // namespace

Bytes EncodeRecord(const WorkRecord& record) {
  Writer out;
  std::visit([&](const auto& one) { Write(one, out); }, record);
  return out.Take();
}

std::optional<WorkRecord> DecodeRecord(ByteSpan bytes) {
  Reader in(bytes);
  std::optional<WorkRecord> record;
  switch (in.ReadKind()) {
    case Kind::kSubmap:
      record = ReadSubmap(in);
      break;
    case Kind::kMatch:
      record = ReadMatch(in);
      break;
    case Kind::kSearch:
      record = ReadSearch(in);
      break;
    case Kind::kCut:
      record = ReadCut(in);
      break;
    case Kind::kPair:
      record = ReadPair(in);
      break;
  }
  return in.IsAtEnd() ? record : std::nullopt;
}

}  // namespace atlas
