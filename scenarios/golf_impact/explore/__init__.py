"""The page of `golf-impact explore`: one impact, interactive, in a browser.

`evaluator.py` computes what is shown, on this machine or in an exported page; `page.js` shows it.
"""
