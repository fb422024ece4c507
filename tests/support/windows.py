"""Tests that need what Windows has not, and what that is; ci.yml says what runs there at all."""

SH = "commands are carried out by sh"
SIGNALS = "no program can be sent a signal that it can catch"

#: Parts of the ids of tests, and why they are left out.
NOT_THERE = {
    "test_a_file_is_replaced_as_a_whole_and_keeps_its_mode": "no permissions as on POSIX",
    "test_a_link_stays_a_link": "links need a right of their own",
    "test_links_to_folders_are_followed_and_circles_end": "links need a right of their own",
    "test_links_below_the_package_are_not_followed": "links need a right of their own",
    "test_a_package_folder_that_is_a_link_is_fine": "links need a right of their own",
    "test_a_tracked_folder_is_no_repository": "what git stores cannot be removed",
    "test_a_very_deep_folder_is_no_problem": "paths are short",
    "test_golden_case[IDL223_same_python_module]": "files cannot differ in capitals only",
    "test_golden_case[IDL601_unreadable]": "names and messages of the system differ",
    "test_golden_case[IDL605_named_pipe]": "no named pipes",
    "test_golden_case[IDL607_standard_library]": "other modules are part of the interpreter",
    "test_golden_case[IDL614_foreign]": "links need a right of their own",
    "test_golden_case[IDL632_unusable_library]": SH,
    "test_two_routers_cannot_have_one_port": "two programs can listen on one port",
    "test_the_router_command_runs_until_it_is_stopped": SIGNALS,
    "test_signals_end_a_program_without_a_trace": SIGNALS,
    "test_a_blocked_call_ends_with_the_program": SIGNALS,
    "robot/test_offer.py::test_publisher_and_subscriber": SIGNALS,
    "robot/test_offer.py::test_action_that_is_cancelled": SIGNALS,
    "test_every_page_shows_how_to_get_the_code_and_how_to_avoid_it": SH,
}
