// What whoever watches a store learns of its writer.
#include <future>

#include "tests/server/store/faulty_vfs.h"
#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

class ProbeTest : public StoreTest {
 protected:
  Result<bool> Probe(AtlasStore::ProbeDepth depth) {
    return Await<bool>([&](auto done) { store_->Probe(depth, std::move(done)); });
  }
  std::uint64_t commits() const { return store_->ReadWriteFigures().commits.count(); }
};

TEST_F(ProbeTest, AProbeChangesNothing) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(0, {{0, 1, 2}})).has_value());
  const StoreCounts before = store_->ReadCounts().value();
  EXPECT_TRUE(Probe(AtlasStore::ProbeDepth::kDisk).has_value());
  EXPECT_TRUE(Probe(AtlasStore::ProbeDepth::kQueue).has_value());
  const StoreCounts after = store_->ReadCounts().value();
  EXPECT_EQ(after.revision, before.revision);
  EXPECT_EQ(after.keyframes, before.keyframes);
  EXPECT_EQ(after.dirty_tiles, before.dirty_tiles);
  EXPECT_EQ(store_->revision(), before.revision);
}

// A row that stays what it was is no page for SQLite to write.
TEST_F(ProbeTest, ADiskIsWrittenToAndAQueueIsNot) {
  FaultyVfs vfs;
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(0, {{0, 1, 2}})).has_value());
  vfs.FailAt(1, FaultyVfs::Calls::kWrite, FaultyVfs::Until::kHealed, true);
  EXPECT_TRUE(Probe(AtlasStore::ProbeDepth::kQueue).has_value());
  EXPECT_EQ(vfs.first(), "");
  const auto full = Probe(AtlasStore::ProbeDepth::kDisk);
  ASSERT_FALSE(full.has_value());
  EXPECT_EQ(full.error().code(), StatusCode::kResourceExhausted) << full.error().message();
  EXPECT_EQ(vfs.first(), "write atlas.db-wal");
  vfs.Heal();
  EXPECT_TRUE(Probe(AtlasStore::ProbeDepth::kDisk).has_value());
  vfs.FailAt(1, FaultyVfs::Calls::kSync, FaultyVfs::Until::kOnce);
  EXPECT_FALSE(Probe(AtlasStore::ProbeDepth::kDisk).has_value()) << "and to the disk it goes";
  vfs.Heal();
  store_.reset();
}

TEST_F(ProbeTest, WhatIsWrittenIsCountedAndWhatIsNotIsNot) {
  Open();
  EXPECT_EQ(commits(), 0u);
  ASSERT_TRUE(Put(MakeKeyframe(0, {{0, 1, 2}})).has_value());
  EXPECT_EQ(commits(), 1u);
  ASSERT_TRUE(Put(MakeKeyframe(0, {{0, 1, 2}}))->is_duplicate);
  ASSERT_TRUE(Probe(AtlasStore::ProbeDepth::kQueue).has_value());
  EXPECT_EQ(commits(), 1u);
  ASSERT_TRUE(Probe(AtlasStore::ProbeDepth::kDisk).has_value());
  EXPECT_EQ(commits(), 2u);
  EXPECT_GT(store_->ReadWriteFigures().commits.sum_s, 0.0);
  EXPECT_EQ(store_->ReadWriteFigures().queued, 0u);
}

TEST_F(ProbeTest, AWriteThatMakesNoSenseIsNoRefusal) {
  Open();
  EXPECT_FALSE(Update({{{{"bus", "nowhere"}, 0}, PoseAt(1), {}}}).has_value());
  EXPECT_FALSE(store_->ReadWriteFigures().last_refusal.has_value());
}

TEST_F(ProbeTest, AFullQueueRefusesWritesAndTakesProbes) {
  options_.max_queued_writes = 0;
  Open();
  const auto put = Put(MakeKeyframe(0, {}));
  ASSERT_FALSE(put.has_value());
  const auto refusal = store_->ReadWriteFigures().last_refusal;
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(refusal->why, put.error());
  EXPECT_TRUE(Probe(AtlasStore::ProbeDepth::kDisk).has_value());
}

}  // namespace
}  // namespace atlas
