"""Audits of many missions: discovery, isolated work, store, trends and the fleet page."""
