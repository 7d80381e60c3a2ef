// A vehicle that localizes and plans in what the real daemon sends it, and in what it holds of
// that.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "client/drive/drive_survey.h"
#include "client/map/cell_address.h"
#include "client/onboard/held_map.h"
#include "client/onboard/held_tiles.h"
#include "core/localization/cloud_localizer.h"
#include "core/planning/plan_route.h"
#include "core/scan/scan_reader.h"
#include "tests/client/end_to_end/vehicle_fixture.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPatience{30'000};
constexpr double kEverywhere_m = 400.0;

Eigen::Quaterniond LevelOf(const Pose& T_world_sensor) {
  const Eigen::Matrix3d& R = T_world_sensor.linear();
  const Eigen::AngleAxisd back(-std::atan2(R(1, 0), R(0, 0)), Eigen::Vector3d::UnitZ());
  return Eigen::Quaterniond(back.toRotationMatrix() * R);
}

class OnboardTest : public VehicleTest {
 protected:
  // What somebody who looks at the drive afterwards knows of a scan's place.
  struct Told {
    LocalizationResult result;
    double error_m = 0.0;

    bool is_good() const { return result.health == LocalizationHealth::kGood; }
  };

  static void SetUpTestSuite() {
    VehicleTest::SetUpTestSuite();
    WriteStreet(shared_root / "street", 0);
    WriteStreet(shared_root / "other_lane", 2);
  }
  void SetUp() override {
    ASSERT_EQ(
        RunAtlas(daemon_.address(), {"ingest", (shared_root / "street").string(), "--every", "0"})
            .exit_code,
        0);
    ASSERT_EQ(RunAtlas(daemon_.address(), {"wait"}).exit_code, 0);
  }
  static AroundOptions Patient() {
    AroundOptions options;
    options.deadline = kPatience;
    return options;
  }
  static CloudLocalizer LocalizerOf(const MapProfile& profile,
                                    TilesAround tiles,
                                    RelocalizerSource relocalizer = {}) {
    const DriveFolder drive = OpenDriveFolder(shared_root / "other_lane").value();
    CloudLocalizerOptions options;
    options.localizer.features.max_range_m = 40.0F;
    return {profile, SurveySensor(drive, {}).value().layout, std::move(tiles), options,
            std::move(relocalizer)};
  }
  // Told where it starts, not where it goes.
  static std::vector<Told> Track(CloudLocalizer& localizer,
                                 const std::vector<DriveScan>& scans,
                                 Eigen::Vector2d* last_m = nullptr) {
    std::vector<Told> told;
    localizer.Start(scans.front().T_world_sensor);
    for (const DriveScan& scan : scans) {
      const PointCloud cloud = ReadScan(scan.scan).value();
      const auto result = localizer.Localize(cloud, LevelOf(scan.T_world_sensor));
      EXPECT_TRUE(result) << result.error().message();
      const Eigen::Vector3d at = result->T_world_sensor.translation();
      if (last_m != nullptr) *last_m = at.head<2>();
      told.push_back({*result, (at - scan.T_world_sensor.translation()).norm()});
    }
    return told;
  }
  static std::vector<DriveScan> Scans() {
    return OpenDriveFolder(shared_root / "other_lane").value().scans;
  }

  DaemonProcess daemon_{NewData(), kSmall};
};

TEST_F(OnboardTest, TilesThatComeLateAreCoarseFirstAndItSaysSo) {
  AtlasLink link = LinkTo(*Endpoint::Parse(daemon_.address()));
  TileStore store = StoreFor(**link.Wait(kPatience));
  AtlasView view(store, &link);
  AroundOptions options = Patient();
  options.budget_bytes = 90'000;  // some tiles a call
  int calls = 0;
  bool was_finest = false;
  CloudLocalizer localizer =
      LocalizerOf(store.atlas().profile, TilesOf(view, options, [&](const MapAround& map) {
                    ++calls;
                    was_finest = map.is_finest_everywhere();
                  }));
  const std::vector<Told> told = Track(localizer, Scans());
  EXPECT_EQ(told.front().result.cover, MapCover::kCoarse);
  int coarse = 0;
  int good = 0;
  for (std::size_t i = 0; i < told.size(); ++i) {
    const bool is_fine = told[i].result.cover == MapCover::kFine;
    coarse += is_fine ? 0 : 1;
    good += told[i].is_good() ? 1 : 0;
    EXPECT_TRUE(is_fine || !told[i].is_good()) << i;
    EXPECT_LT(told[i].error_m, told[i].is_good() ? 0.1 : 1.0) << i;
  }
  EXPECT_GE(coarse, 3);
  EXPECT_GE(good, static_cast<int>(told.size()) / 2);
  EXPECT_TRUE(told.back().is_good());
  EXPECT_GT(calls, 10);
  EXPECT_TRUE(was_finest);
}

TEST_F(OnboardTest, WithoutALinkItGoesOnInWhatItHolds) {
  AtlasLink link = LinkTo(*Endpoint::Parse(daemon_.address()));
  TileStore store = StoreFor(**link.Wait(kPatience));
  AtlasView(store, &link).Around({0.0, 0.0}, kEverywhere_m, Patient()).value();
  AtlasView offline(store, nullptr);
  int calls = 0;
  CloudLocalizer localizer =
      LocalizerOf(store.atlas().profile, TilesOf(offline, Patient(), [&](const MapAround& map) {
                    ++calls;
                    EXPECT_TRUE(map.is_finest_everywhere());
                    EXPECT_FALSE(map.is_current);
                    EXPECT_FALSE(map.sync.ok());
                  }));
  for (const Told& told : Track(localizer, Scans())) {
    EXPECT_TRUE(told.is_good());
    EXPECT_LT(told.error_m, 0.1);
  }
  EXPECT_GT(calls, 10);
}

TEST_F(OnboardTest, WhoIsCarriedAwayIsFoundInWhatIsHeld) {
  AtlasLink link = LinkTo(*Endpoint::Parse(daemon_.address()));
  TileStore store = StoreFor(**link.Wait(kPatience));
  AtlasView(store, &link).Around({0.0, 0.0}, kEverywhere_m, Patient()).value();
  AtlasView view(store, nullptr);
  const MapProfile profile = store.atlas().profile;
  std::vector<DriveScan> scans = Scans();
  scans.erase(scans.begin() + 10, scans.begin() + 60);  // 125 m
  Eigen::Vector2d last_m = scans.front().T_world_sensor.translation().head<2>();
  int asked = 0;
  const auto last_place = [&] {
    ++asked;
    return last_m;
  };
  CloudLocalizer localizer =
      LocalizerOf(profile, TilesOf(view, Patient()),
                  RelocalizerOf(view, profile, last_place, 300.0, Patient()));
  const std::vector<Told> told = Track(localizer, scans, &last_m);
  for (std::size_t i = 0; i < told.size(); ++i) {
    EXPECT_TRUE(told[i].is_good() || (i >= 10 && i < 18)) << i;  // back after eight scans
    EXPECT_FALSE(told[i].is_good() && i >= 10 && i < 13) << i << ": nobody can know yet";
    EXPECT_TRUE(!told[i].is_good() || told[i].error_m < 0.1) << i << ' ' << told[i].error_m;
  }
  EXPECT_GE(asked, 1);
}

TEST_F(OnboardTest, NobodyIsLookedForWhereNothingIsHeld) {
  AtlasLink link = LinkTo(*Endpoint::Parse(daemon_.address()));
  TileStore store = StoreFor(**link.Wait(kPatience));
  AtlasView offline(store, nullptr);
  const auto here = [] {
    return Eigen::Vector2d(0.0, 0.0);
  };
  const RelocalizerSource source =
      RelocalizerOf(offline, store.atlas().profile, here, 300.0, Patient());
  const auto none = source();
  ASSERT_TRUE(none) << none.error().message();
  EXPECT_EQ(*none, nullptr);
  // Tiles that came since count.
  AtlasView(store, &link).Around({0.0, 0.0}, kEverywhere_m, Patient()).value();
  const auto made = source();
  ASSERT_TRUE(made) << made.error().message();
  EXPECT_NE(*made, nullptr);
  EXPECT_EQ(*source(), *made) << "made once";
  const std::vector<TileId> held = store.TilesIn(DiscArea{{0.0, 0.0}, 50.0}, 0);
  const auto finest =
      std::find_if(held.begin(), held.end(), [](const TileId& id) { return id.level == 0; });
  ASSERT_NE(finest, held.end());
  store.Remove(*finest);
  EXPECT_NE(*source(), *made) << "one went";
}

// ... and around where it was last, not around the world's origin.
TEST_F(OnboardTest, IsLookedForAroundTheLastPlace) {
  AtlasLink link = LinkTo(*Endpoint::Parse(daemon_.address()));
  TileStore store = StoreFor(**link.Wait(kPatience));
  AtlasView view(store, &link);
  const auto beside = [] {
    return Eigen::Vector2d(60.0, 10.0);
  };
  ASSERT_NE(RelocalizerOf(view, store.atlas().profile, beside, 130.0, Patient())().value(),
            nullptr);
  // On the street, 112 m from there, 161 m from the origin.
  const auto address = LocateCell({126.6, 100.0}, 0, store.atlas().profile);
  EXPECT_NE(store.Find(address->tile), nullptr);
}

TEST_F(OnboardTest, ASensorWithoutALayoutIsAnError) {
  AtlasLink link = LinkTo(*Endpoint::Parse(daemon_.address()));
  TileStore store = StoreFor(**link.Wait(kPatience));
  AtlasView view(store, nullptr);
  CloudLocalizer localizer(store.atlas().profile, {}, TilesOf(view, Patient()), {});
  localizer.Start(Pose::Identity());
  const PointCloud cloud = ReadScan(Scans().front().scan).value();
  const auto result = localizer.Localize(cloud, Eigen::Quaterniond::Identity());
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code(), StatusCode::kInvalidArgument);
}

TEST_F(OnboardTest, PlansInWhatIsHeldAsTheCommandLineDoesInTheWhole) {
  const std::vector<DriveScan> scans = Scans();
  PlanRequest request;
  request.from = scans.at(5).T_world_sensor.translation();
  request.to = scans.at(scans.size() - 6).T_world_sensor.translation();
  const auto text = [](const Eigen::Vector3d& p) {
    return std::to_string(p.x()) + "," + std::to_string(p.y()) + "," + std::to_string(p.z());
  };
  const CommandRun run = RunAtlas(
      daemon_.address(), {"plan", "--from=" + text(request.from), "--to=" + text(request.to)});
  ASSERT_EQ(run.exit_code, 0) << run.err;

  AtlasLink link = LinkTo(*Endpoint::Parse(daemon_.address()));
  TileStore store = StoreFor(**link.Wait(kPatience));
  const MapProfile profile = store.atlas().profile;
  HeldTiles nothing(store);
  const auto none = PlanRoute(nothing, profile, request);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code(), StatusCode::kNotFound) << none.error().message();
  EXPECT_GT(nothing.not_held(), 0U);

  AtlasView(store, &link).Around({0.0, 0.0}, kEverywhere_m, Patient()).value();
  HeldTiles all(store);
  const auto route = PlanRoute(all, profile, request);
  ASSERT_TRUE(route) << route.error().message();
  ASSERT_TRUE(route->found);
  EXPECT_NEAR(route->cost, run.json().at("cost").to_number<double>(), 0.01);
  EXPECT_NEAR(route->length_m, run.json().at("length_m").to_number<double>(), 0.01);
}

}  // namespace
}  // namespace atlas
