// Claim: a file that a stranger has made and sealed leads to no other file, takes no more memory than it can fill, and
// is refused with a message that names the dataset and the rule.
#include <gmock/gmock.h>

#include "archive/schema/schema.h"
#include "tests/archive/forge.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::AllOf;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

constexpr hid_t kPlain = H5P_DEFAULT;

/// A dataset of doubles in place of /traces/hold/end_time.
void put_end_time(hid_t file, std::uint64_t rows, hid_t creation, bool written) {
  drop(file, "traces/hold/end_time");
  const hsize_t extent = rows;
  const hdf5::Handle space(H5Screate_simple(1, &extent, nullptr), H5Sclose, "space");
  const hdf5::Handle dataset(
      H5Dcreate2(file, "traces/hold/end_time", H5T_IEEE_F64LE, space.id(), kPlain, creation, kPlain), H5Dclose, "new");
  const std::vector<double> data(written ? rows : 0);
  if (written) H5Dwrite(dataset.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, kPlain, data.data());
}

hdf5::Handle creation() { return hdf5::Handle(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "list"); }

class Stranger : public ::testing::Test {
 protected:
  /// What reading says of the packed campaign with one thing changed.
  std::string after(const std::function<void(hid_t)>& change) const {
    return refusal(forged(folder_, source_, change));
  }
  Folder folder_;
  fs::path source_ = packed(folder_);
};

TEST_F(Stranger, LinksLeadNowhereElse) {
  EXPECT_THAT(after([&](hid_t f) {
                drop(f, "traces/hold/end_time");
                H5Lcreate_external(source_.c_str(), "/traces/hold/end_time", f, "traces/hold/end_time", kPlain, kPlain);
              }),
              AllOf(HasSubstr("forged.h5: 'traces/hold/end_time' is a link to another file"), HasSubstr("hard links")));
  EXPECT_THAT(after([&](hid_t f) {
                drop(f, "traces/hold");
                H5Lcreate_external(source_.c_str(), "/traces/hold", f, "traces/hold", kPlain, kPlain);
              }),
              HasSubstr("'traces/hold' is a link to another file"));
  EXPECT_THAT(after([](hid_t f) {
                drop(f, "names/bodies");
                H5Lcreate_soft("/names/q", f, "names/bodies", kPlain, kPlain);
              }),
              HasSubstr("'names/bodies' is a soft link"));
}

TEST_F(Stranger, DataLieInTheFileItself) {
  put(folder_ / "secret", std::string(128, 'x'));
  EXPECT_THAT(after([&](hid_t f) {
                const hdf5::Handle list = creation();
                H5Pset_external(list.id(), (folder_ / "secret").c_str(), 0, 128);
                put_end_time(f, 16, list.id(), false);
              }),
              AllOf(HasSubstr("'traces/hold/end_time'"), HasSubstr("lie in another file")));
  EXPECT_THAT(after([&](hid_t f) {
                drop(f, "names/bodies");
                const hsize_t extent = 4;
                const hdf5::Handle list = creation();
                H5Pset_external(list.id(), (folder_ / "secret").c_str(), 0, 64);
                const hdf5::Handle space(H5Screate_simple(1, &extent, nullptr), H5Sclose, "space");
                const hdf5::Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "type");
                H5Tset_size(type.id(), H5T_VARIABLE);
                hdf5::Handle(H5Dcreate2(f, "names/bodies", type.id(), space.id(), kPlain, list.id(), kPlain), H5Dclose,
                             "new");
              }),
              AllOf(HasSubstr("'names/bodies'"), HasSubstr("lie in another file")));
}

// HDF5 opens the sources of a virtual dataset as soon as it is asked for its size.
TEST_F(Stranger, NoDatasetIsVirtual) {
  const hdf5::Lock lock;
  const hdf5::Handle file(H5Fcreate((folder_ / "virtual.h5").c_str(), H5F_ACC_TRUNC, kPlain, kPlain), H5Fclose, "new");
  const hsize_t extent = 16;
  const hdf5::Handle space(H5Screate_simple(1, &extent, nullptr), H5Sclose, "space");
  const hdf5::Handle list = creation();
  H5Pset_virtual(list.id(), space.id(), source_.c_str(), "/traces/hold/end_time", space.id());
  hdf5::Handle(H5Dcreate2(file.id(), "data", H5T_IEEE_F64LE, space.id(), kPlain, list.id(), kPlain), H5Dclose, "new");
  EXPECT_THAT(message_of<hdf5::Error>([&] { hdf5::open_dataset(file.id(), "data"); }),
              AllOf(HasSubstr("'data'"), HasSubstr("virtual")));
}

TEST_F(Stranger, FiltersAndTypesAreThoseOfAnArchive) {
  const auto chunked = [](hsize_t rows) {
    hdf5::Handle list = creation();
    H5Pset_chunk(list.id(), 1, &rows);
    return list;
  };
  EXPECT_THAT(after([&](hid_t f) {
                const hdf5::Handle list = chunked(16);
                H5Pset_fletcher32(list.id());
                put_end_time(f, 16, list.id(), true);
              }),
              HasSubstr("filters are not shuffle and deflate"));
  EXPECT_THAT(after([&](hid_t f) {
                const hdf5::Handle list = chunked(16);
                H5Pset_deflate(list.id(), 9);
                H5Pset_deflate(list.id(), 9);
                put_end_time(f, 16, list.id(), true);
              }),
              HasSubstr("once each"));
  EXPECT_THAT(after([&](hid_t f) {
                const hdf5::Handle list = chunked(1 << 20);
                H5Pset_deflate(list.id(), 9);
                put_end_time(f, 1 << 20, list.id(), true);
              }),
              HasSubstr("chunks of 1048576 rows of 8 bytes"));
  EXPECT_THAT(after([](hid_t f) {
                drop(f, "traces/hold/end_time");
                const hdf5::Handle type(H5Tcopy(H5T_IEEE_F64LE), H5Tclose, "type");
                H5Tcommit2(f, "shared", type.id(), kPlain, kPlain, kPlain);
                const hsize_t extent = 16;
                const hdf5::Handle space(H5Screate_simple(1, &extent, nullptr), H5Sclose, "space");
                hdf5::Handle(H5Dcreate2(f, "traces/hold/end_time", type.id(), space.id(), kPlain, kPlain, kPlain),
                             H5Dclose, "new");
              }),
              HasSubstr("committed type"));
}

TEST_F(Stranger, ClaimsNoMoreRowsThanAreStored) {
  EXPECT_THAT(after([](hid_t f) { put_end_time(f, 16, kPlain, false); }),
              HasSubstr("more rows than the file can hold: 16 of 8 bytes, of which 0 bytes are stored"));
  EXPECT_THAT(after([](hid_t f) {
                const hdf5::Handle list = creation();
                const hsize_t rows = 1 << 10;
                H5Pset_chunk(list.id(), 1, &rows);
                H5Pset_deflate(list.id(), 9);
                put_end_time(f, std::uint64_t{1} << 40, list.id(), false);
              }),
              AllOf(HasSubstr("'traces/hold/end_time' claims more rows"), HasSubstr("deflate makes at most 1032")));
  EXPECT_THAT(after([](hid_t f) {
                hdf5::check(H5Adelete(f, "particles"), "particles");
                hdf5::write_attribute(f, "particles", std::uint64_t{1} << 60);
              }),
              HasSubstr("'particles' is 1152921504606846976; a campaign has 1 to 4294967296"));
}

// One long text to which a thousand rows refer would be a hundred megabytes.
TEST_F(Stranger, ClaimsNoMoreTextThanIsStored) {
  constexpr std::size_t kRows = 1000, kReference = 16;
  std::uint64_t where = 0;
  const fs::path file = forged(folder_, source_, [&](hid_t f) {
    drop(f, "names/bodies");
    std::vector<std::string> texts(kRows, "short");
    texts[0].assign(100'000, 'x');
    hdf5::write_strings(f, "names/bodies", texts);
    const hdf5::Handle dataset(H5Dopen2(f, "names/bodies", kPlain), H5Dclose, "names/bodies");
    where = H5Dget_offset(dataset.id());
  });
  std::string bytes = content(file);
  for (std::size_t i = 1; i < kRows; ++i) {
    bytes.replace(where + i * kReference, kReference, bytes.substr(where, kReference));
  }
  put(file, bytes);
  reseal(file);
  EXPECT_THAT(refusal(file), HasSubstr("'names/bodies' claims more text than the file"));
}

}  // namespace
}  // namespace graze
