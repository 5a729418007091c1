#!/usr/bin/python3 -B
"""The documentation site is built, whole and for itself: site_test.py PROGRAM"""

import html.parser
import pathlib
import subprocess
import sys
import tempfile
import unittest
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parents[2]
program = ""


class Page(html.parser.HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.links, self.fetched, self.ids = [], [], set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        if "id" in given:
            self.ids.add(given["id"])
        if tag == "a" and given.get("href"):
            self.links.append(given["href"])
        if tag in ("script", "img", "source") and given.get("src"):
            self.fetched.append(given["src"])
        if tag == "link" and given.get("rel") in ("stylesheet", "icon", "preload"):
            self.fetched.append(given["href"])


class Site(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.held = tempfile.TemporaryDirectory(prefix="luxfield_site_")
        done = subprocess.run(
            [sys.executable, "-B", ROOT / "docs/site/build_site.py", program, cls.held.name], text=True, capture_output=True
        )
        if done.returncode:  # mkdocs is strict: a warning is an error
            raise AssertionError(done.stdout + done.stderr)
        cls.site = pathlib.Path(cls.held.name) / "site"
        cls.pages = {path: Page(path.read_text()) for path in cls.site.rglob("*.html") if path.name != "404.html"}

    @classmethod
    def tearDownClass(cls):
        cls.held.cleanup()

    def target(self, page, link):
        path = (page.parent / urllib.parse.unquote(link)).resolve()
        return path / "index.html" if path.is_dir() else path

    def test_every_page_is_in_the_navigation(self):
        navigation = (ROOT / "docs/site/mkdocs.yml").read_text()
        for page in [*ROOT.glob("docs/*.md"), *ROOT.glob("docs/how-to/*.md")]:
            if page.name != "README.md":  # it is the home page
                self.assertIn(f": {page.relative_to(ROOT / 'docs')}\n", navigation)

    def test_every_link_leads_somewhere(self):
        for path, page in self.pages.items():
            for link in page.links:
                if urllib.parse.urlparse(link).scheme:
                    continue
                name, _, anchor = link.partition("#")
                target = self.target(path, name) if name else path
                self.assertTrue(target.exists(), f"{path.relative_to(self.site)}: {link}")
                if anchor and target in self.pages:
                    self.assertIn(urllib.parse.unquote(anchor), self.pages[target].ids | {"__skip"}, f"{path}: {link}")

    def test_nothing_comes_from_a_network(self):
        for path, page in self.pages.items():
            for source in page.fetched:
                self.assertFalse(urllib.parse.urlparse(source).scheme, f"{path}: {source}")
                self.assertTrue(self.target(path, source.partition("?")[0]).exists(), f"{path}: {source}")

    def test_every_page_is_reached_from_home(self):
        reached, ahead = set(), [self.site / "index.html"]
        while ahead:
            path = ahead.pop()
            if path in reached or path not in self.pages:
                continue
            reached.add(path)
            ahead += [self.target(path, link.partition("#")[0]) for link in self.pages[path].links if not urllib.parse.urlparse(link).scheme]
        self.assertEqual(set(self.pages) - reached, set())

    def test_every_verb_has_a_page(self):
        merge = (self.site / "reference/verbs/merge/index.html").read_text()
        self.assertIn("--estimator", merge)
        self.assertIn("inverse-variance", merge)
        self.assertTrue((self.site / "reference/verbs/calibrate-sensor/index.html").exists())

    def test_headers_are_those_that_are_installed(self):
        lightfield = (self.site / "reference/headers/lightfield/index.html").read_text()
        self.assertIn("TotalFlux", lightfield)


if __name__ == "__main__":
    program = sys.argv.pop(1)
    try:
        import yaml  # noqa: F401

        subprocess.run(["mkdocs", "--version"], capture_output=True, check=True)
    except (ImportError, OSError):
        print("SKIPPED: site: mkdocs or PyYAML is missing")
        sys.exit(77)
    unittest.main()
