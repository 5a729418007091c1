# Every program of tests, and the scripts. Read by CMakeLists.txt; paths start at the root.
find_package(GTest REQUIRED)

# Devices that are not there: a library for tests, and a program for tests of the whole program; what
# is preloaded into programs under test.
add_subdirectory(tests/fakes)
add_subdirectory(tests/preload)

foreach(room core lightfield environment formats rig session capture reconstruct scene preprocess web)
  luxfield_tests(${room} USES luxfield_${room})
endforeach()
luxfield_tests(bridges USES luxfield_bridges luxfield_formats)
luxfield_tests(photometry USES luxfield_photometry luxfield_reconstruct)
luxfield_tests(shard USES luxfield_shard luxfield_capture)
if(LUXFIELD_BUILD_BENCH)  # whose scenes and labs these light and measure
  foreach(room render planning bench physics)
    luxfield_tests(${room} USES luxfield_bench)
  endforeach()
endif()
if(TARGET luxfield_view)
  luxfield_tests(view USES luxfield_view luxfield::opencv_imgproc DEPENDS luxfield luxfield_view_program lost_device)
  target_sources(view_test PRIVATE tests/e2e/program.cc)
endif()
find_package(ZLIB REQUIRED)  # inflates what printed PDF files draw
target_link_libraries(capture_test PRIVATE ZLIB::ZLIB)
# Its fake stages move in real time, and tests catch them on the way: nothing runs beside it.
luxfield_tests(hal USES luxfield_hal luxfield_fakes SERIAL)
# What all drivers of an interface have to pass.
target_sources(hal_test PRIVATE tests/conformance/camera_conformance.cc
                                tests/conformance/instrument_conformance.cc)
# Sees the disk at the system calls that core/ makes (tests/storage/disk_calls.h).
luxfield_tests(storage USES luxfield_session)
foreach(call open close read write ftruncate fsync fdatasync rename unlink mkdir)
  target_link_options(storage_test PRIVATE -Wl,--wrap=${call})
endforeach()
if(LUXFIELD_FUZZ)
  add_subdirectory(tests/fuzz)
endif()
# Drivers against devices that umockdev plays.
luxfield_find_pkg(UMOCKDEV umockdev-1.0)
find_program(UMOCKDEV_WRAPPER umockdev-wrapper)
if(TARGET PkgConfig::UMOCKDEV AND UMOCKDEV_WRAPPER)
  luxfield_tests(usbtmc USES luxfield_hal PkgConfig::UMOCKDEV UNDER ${UMOCKDEV_WRAPPER})
  target_sources(usbtmc_test PRIVATE tests/conformance/instrument_conformance.cc
                                     tests/usb/fake_usb_device.cc)
  luxfield_tests(transports USES luxfield_capture luxfield_reconstruct luxfield_fakes PkgConfig::UMOCKDEV
                 UNDER ${UMOCKDEV_WRAPPER})
  target_sources(transports_test PRIVATE tests/e2e/frames_as_seen.cc tests/usb/fake_usb_device.cc
                                         tests/usbtmc/device_side.cc tests/usbtmc/fake_instrument.cc)
  if(LUXFIELD_GPIOD)
    luxfield_tests(gpiod USES luxfield_hal luxfield_fakes PkgConfig::UMOCKDEV UNDER ${UMOCKDEV_WRAPPER})
    target_sources(gpiod_test PRIVATE tests/conformance/instrument_conformance.cc
                                      tests/usb/fake_usb_device.cc tests/usbtmc/device_side.cc
                                      tests/usbtmc/fake_instrument.cc)
  endif()
  if(LUXFIELD_GPHOTO2)
    luxfield_tests(gphoto2 USES luxfield_hal luxfield_fakes PkgConfig::UMOCKDEV UNDER ${UMOCKDEV_WRAPPER})
    target_sources(gphoto2_test PRIVATE tests/conformance/camera_conformance.cc
                                        tests/usb/fake_usb_device.cc)
  endif()
else()
  message(WARNING "umockdev is missing: the drivers of GPIO lines, still cameras and USBTMC instruments are not tested")
endif()
if(NOT LUXFIELD_GPHOTO2)
  message(WARNING "libgphoto2 or LibRaw is missing: no driver for still cameras")
endif()
if(LUXFIELD_ARAVIS)
  # GigE Vision has one port, which the fake camera of a suite takes.
  luxfield_tests(aravis LOCK USES luxfield_hal PkgConfig::ARAVIS)
  target_sources(aravis_test PRIVATE tests/conformance/camera_conformance.cc tests/fakes/line_input.cc)
else()
  message(WARNING "aravis is missing: no driver for GigE and USB3 Vision cameras")
endif()
# Drivers on Debian's kernel in a virtual machine, which `./run kernel` fetches; skipped without it.
if(LUXFIELD_GPIOD)
  add_executable(usbtmc_gadget tests/vm/gadget/usbtmc_gadget_main.cc tests/usbtmc/device_side.cc)
  target_include_directories(usbtmc_gadget PRIVATE ${PROJECT_SOURCE_DIR} ${LUXFIELD_INCLUDE})
  target_link_libraries(usbtmc_gadget PRIVATE fmt::fmt Threads::Threads)
  set(beside_vm_test usbtmc_gadget)
  set(gpiod2 ${PROJECT_SOURCE_DIR}/build/kernel/gpiod2)
  if(EXISTS ${gpiod2} AND NOT LUXFIELD_LIBGPIOD_IS_2)
    # libgpiod 2 under the same driver: its symbols, and our objects for it, come before those of the room.
    add_executable(vm_gpiod2_test tests/vm/gpio_test.cc tests/vm/gpio_sim.cc tests/vm/attribute.cc
                                  hal/drivers/gpiod/gpio_lines_v2.cc)
    target_compile_definitions(vm_gpiod2_test PRIVATE LUXFIELD_LIBGPIOD=2)
    target_include_directories(vm_gpiod2_test PRIVATE ${PROJECT_SOURCE_DIR} ${LUXFIELD_INCLUDE})
    target_include_directories(vm_gpiod2_test SYSTEM BEFORE PRIVATE ${gpiod2}/include)
    target_link_libraries(vm_gpiod2_test PRIVATE ${gpiod2}/libgpiod2.a luxfield_hal luxfield_test_main)
    list(APPEND beside_vm_test vm_gpiod2_test)
  endif()
  list(TRANSFORM beside_vm_test REPLACE "(.+)" "$<TARGET_FILE:\\1>" OUTPUT_VARIABLE files_beside_vm_test)
  luxfield_tests(vm WHOLE USES luxfield_hal DEPENDS fake_device ${beside_vm_test}
                 UNDER ${PROJECT_SOURCE_DIR}/tests/vm/boot --stage $<TARGET_FILE:fake_device> ${files_beside_vm_test})
  target_compile_definitions(vm_test PRIVATE LUXFIELD_LIBGPIOD=$<IF:$<BOOL:${LUXFIELD_LIBGPIOD_IS_2}>,2,1>)
  set_tests_properties(vm PROPERTIES SKIP_RETURN_CODE 77 LABELS vm TIMEOUT 700)
endif()
# The whole lab: every driver at once, against fakes of all devices.
if(TARGET PkgConfig::UMOCKDEV AND UMOCKDEV_WRAPPER AND LUXFIELD_GPIOD AND LUXFIELD_ARAVIS AND LUXFIELD_GPHOTO2)
  luxfield_tests(lab SERIAL USES luxfield_hal luxfield_fakes PkgConfig::UMOCKDEV UNDER ${UMOCKDEV_WRAPPER}
                 DEPENDS luxfield fake_camera fake_still_camera line_descriptors bad_network)
  target_sources(lab_test PRIVATE tests/e2e/frames_as_seen.cc tests/e2e/program.cc
                                    tests/gpiod/fake_gpio_chip.cc tests/usb/fake_usb_device.cc tests/usbtmc/device_side.cc
                                    tests/usbtmc/fake_instrument.cc)
else()
  message(WARNING "umockdev, libgpiod, aravis, libgphoto2 or LibRaw is missing: no session through all drivers is tested")
endif()
# The program as a user runs it, `luxfield bench` included.
if(LUXFIELD_BUILD_BENCH)
  luxfield_tests(e2e USES luxfield_bench luxfield_fakes DEPENDS luxfield luxfield_bench_program luxfield_view_program device_bench
                 fake_device die_at_disk_call no_codecs)
  if(TARGET luxfield_view)
    target_compile_definitions(e2e_test PRIVATE LUXFIELD_VIEW)
  endif()
  # Parallel loops over the system's threads, in place of the room's over TBB.
  luxfield_tests(device_bench USES luxfield_core)
  target_sources(device_bench_test PRIVATE device_bench/parallel.cc)
  # Hostile inputs over every verb; a seeded sample of what `./run hostile` runs. Skipped where numpy is missing.
  add_executable(hostile_zygote tests/hostile/zygote.cc)
  target_link_libraries(hostile_zygote PRIVATE luxfield_bench)
  if(TARGET luxfield_view)
    target_sources(hostile_zygote PRIVATE tests/hostile/reload.cc)
    target_include_directories(hostile_zygote PRIVATE ${PROJECT_SOURCE_DIR})
    target_link_libraries(hostile_zygote PRIVATE luxfield_view)
    target_compile_definitions(hostile_zygote PRIVATE LUXFIELD_VIEW)
  endif()
  add_test(NAME hostile COMMAND ${PROJECT_SOURCE_DIR}/tests/hostile/run $<TARGET_FILE:hostile_zygote> --cases 150 --seed 1)
  set_tests_properties(hostile PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 1200)
endif()
# Those that look at pictures link what the program loads when it needs it.
foreach(folder reconstruct scene render bench view e2e)
  if(TARGET ${folder}_test)
    target_link_libraries(${folder}_test PRIVATE luxfield::opencv_imgcodecs)
  endif()
endforeach()
# Jobs cut into shards, on the engines of one machine and, as a seeded sample of what `./run cluster` runs, on a Slurm,
# which is skipped where there is none.
add_test(NAME shards COMMAND ${PROJECT_SOURCE_DIR}/tests/cluster/verbs_test.py $<TARGET_FILE:luxfield>)
set_tests_properties(shards PROPERTIES TIMEOUT 1200)
add_test(NAME cluster COMMAND ${PROJECT_SOURCE_DIR}/tests/cluster/cluster_test.py $<TARGET_FILE:luxfield> --kills 4)
set_tests_properties(cluster PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 1900)
# The program judged by Python and numpy, which share no code with it; skipped where numpy is missing.
add_test(NAME judges COMMAND ${PROJECT_SOURCE_DIR}/tests/judges/run $<TARGET_FILE:luxfield>)
set_tests_properties(judges PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 3600)
# Kernels by the compilers of GPUs that are not here; skipped where clang or libclc is missing.
add_executable(write_programs tests/offline/write_programs.cc)
target_link_libraries(write_programs PRIVATE luxfield_render)
add_test(NAME offline COMMAND ${PROJECT_SOURCE_DIR}/tests/offline/offline_test.py $<TARGET_FILE:write_programs>)
set_tests_properties(offline PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 1200)
# Includes go along the arrows of tests/layout/arrows.txt, and the benches can be left out.
add_test(NAME layout COMMAND ${PROJECT_SOURCE_DIR}/tests/layout/layout_test.py)
# `./run mutants`, on a tree of a few lines.
add_test(NAME mutants COMMAND ${PROJECT_SOURCE_DIR}/tests/mutants/mutants_test.py)
set_tests_properties(mutants PROPERTIES TIMEOUT 1200)
# Comments and docs: what they cite is there, formulas are whole, pages are wrapped.
add_test(NAME docs COMMAND ${PROJECT_SOURCE_DIR}/tests/docs/docs_test.py)
# Commands that the pages state: the program takes them, and those of the tutorial and the how-tos are run.
add_test(NAME commands COMMAND ${PROJECT_SOURCE_DIR}/tests/docs/commands_test.py $<TARGET_FILE:luxfield>)
set_tests_properties(commands PROPERTIES TIMEOUT 1800)
# Another project's view: the installed tree, the tree as part of the project, pkg-config.
add_test(NAME consumer COMMAND ${PROJECT_SOURCE_DIR}/tests/consumer/consumer_test.py ${PROJECT_BINARY_DIR})
set_tests_properties(consumer PROPERTIES TIMEOUT 3600)
# Man pages and completions, made of what the program says of itself.
add_test(NAME packaging COMMAND ${PROJECT_SOURCE_DIR}/tests/packaging/packaging_test.py $<TARGET_FILE:luxfield>)
# The open data set, of its smallest lamp.
add_test(NAME dataset COMMAND ${PROJECT_SOURCE_DIR}/tests/dataset/dataset_test.py $<TARGET_FILE:luxfield>)
set_tests_properties(dataset PROPERTIES TIMEOUT 1200)
# The documentation site; skipped where mkdocs is missing.
add_test(NAME site COMMAND ${PROJECT_SOURCE_DIR}/tests/site/site_test.py $<TARGET_FILE:luxfield>)
set_tests_properties(site PROPERTIES SKIP_RETURN_CODE 77)
